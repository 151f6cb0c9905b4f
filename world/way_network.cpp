#include "world/way_network.h"

#include <algorithm>
#include <array>

#include "world/byte_stream.h"
#include "world/sealed_file.h"

namespace terracast::world {
namespace {

constexpr SealedKind kSealed = {.magic = {'T', 'C', 'W', 'A', 'Y', 'S'},
                                .version = kWayFileVersion,
                                .most_bytes = std::size_t{1} << 31,
                                .what = "a network of ways"};
constexpr std::size_t kPointBytes = 12;
/// Of a part of two points, the fewest.
constexpr std::size_t kPartBytes = 42 + 2 * kPointBytes;
/// No paving and no sidewalk is wider; the sums of such widths stay far within 32 bits.
constexpr std::int32_t kWidest_steps = 1 << 18;
/// Of a limit, as tags may say it.
constexpr std::uint16_t kFastest_kmph = 250;
static_assert(kWidest_steps * kHeightStep_m == 256.0);
enum Flag : std::uint8_t {
  kForward = 1,
  kBackward = 2,
  kBridge = 4,
  kTunnel = 8,
  kSiding = 16,
  kAllFlags = 31
};

void put_part(ByteWriter& out, const WayPart& part) {
  out.put(part.layer);
  out.put(part.feature);
  out.put(static_cast<std::uint8_t>(part.kind));
  out.put(static_cast<std::uint8_t>(
      (part.may_go_forward ? kForward : 0) | (part.may_go_backward ? kBackward : 0) |
      (part.is_bridge ? kBridge : 0) | (part.is_tunnel ? kTunnel : 0) |
      (part.is_siding ? kSiding : 0)));
  out.put(part.num_lanes);
  out.put(part.max_speed_kmph);
  for (const std::int32_t steps :
       {part.half_width_steps, part.sidewalk_steps, part.lanes_left_steps, part.lanes_right_steps})
    out.put(steps);
  out.put(part.from_node);
  out.put(part.to_node);
  out.put_count(part.points_steps.size());
  for (const Eigen::Vector3i& point : part.points_steps)
    for (const int value : point) out.put(static_cast<std::int32_t>(value));
}

WayPart get_part(ByteReader& in, std::uint32_t num_nodes) {
  WayPart part;
  part.layer = in.get<std::uint8_t>();
  part.feature = in.get<std::uint64_t>();
  const auto kind = in.get<std::uint8_t>();
  const auto flags = in.get<std::uint8_t>();
  if (kind >= kNumWayKinds || flags > kAllFlags) in.refuse("a code has no meaning");
  part.kind = static_cast<WayKind>(kind);
  part.may_go_forward = (flags & kForward) != 0;
  part.may_go_backward = (flags & kBackward) != 0;
  part.is_bridge = (flags & kBridge) != 0;
  part.is_tunnel = (flags & kTunnel) != 0;
  part.is_siding = (flags & kSiding) != 0;
  part.num_lanes = in.get<std::uint8_t>();
  part.max_speed_kmph = in.get<std::uint16_t>();
  for (std::int32_t* steps : {&part.half_width_steps, &part.sidewalk_steps, &part.lanes_left_steps,
                              &part.lanes_right_steps})
    *steps = in.get<std::int32_t>();
  if (part.max_speed_kmph > kFastest_kmph || (part.is_siding && !is_railway(part.kind)))
    in.refuse("a way's limit, or what it is beside others, has no meaning");
  if (part.num_lanes < 1 || part.half_width_steps < 1 || part.sidewalk_steps < 0 ||
      part.half_width_steps > kWidest_steps || part.sidewalk_steps > kWidest_steps ||
      part.lanes_left_steps > part.half_width_steps ||
      part.lanes_right_steps < -part.half_width_steps ||
      part.lanes_left_steps <= part.lanes_right_steps)
    in.refuse("a way has no lanes or no width");
  part.from_node = in.get<std::uint32_t>();
  part.to_node = in.get<std::uint32_t>();
  if (part.from_node >= num_nodes || part.to_node >= num_nodes)
    in.refuse("a way ends at a node that is not there");
  part.points_steps.resize(in.get_count(kPointBytes));
  if (part.points_steps.size() < 2) in.refuse("a way has no two points");
  for (std::size_t i = 0; i < part.points_steps.size(); ++i) {
    for (int& value : part.points_steps[i]) value = in.get<std::int32_t>();
    if (i > 0 && part.points_steps[i].head<2>() == part.points_steps[i - 1].head<2>())
      in.refuse("two points of a way are one");
  }
  return part;
}

}  // namespace

std::vector<std::byte> encode_ways(const WayNetwork& network) {
  ByteWriter out;
  out.put(network.num_nodes);
  out.put_count(network.parts.size());
  for (const WayPart& part : network.parts) put_part(out, part);
  return sealed(kSealed, out.bytes());
}

WayNetwork decode_ways(std::span<const std::byte> bytes, const std::string& file) {
  const std::vector<std::uint8_t> raw = unsealed(kSealed, bytes, file);
  ByteReader in(raw, file);
  WayNetwork network;
  network.num_nodes = in.get<std::uint32_t>();
  const std::size_t num_parts = in.get_count(kPartBytes);
  if (network.num_nodes > 2 * num_parts) in.refuse("it has more nodes than ways have ends");
  network.parts.reserve(num_parts);
  for (std::size_t i = 0; i < num_parts; ++i)
    network.parts.push_back(get_part(in, network.num_nodes));
  if (!in.is_at_end()) in.refuse("it goes on where it should end");
  return network;
}

}  // namespace terracast::world
