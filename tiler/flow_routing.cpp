#include "tiler/flow_routing.h"

#include <bit>
#include <functional>
#include <queue>

#include "core/error.h"
#include "core/random.h"

namespace terracast::tiler {
namespace {

struct Step {
  int di;
  int dj;
  float distance;
};
constexpr Step kSteps[8] = {{1, 0, 1.0F},         {-1, 0, 1.0F},        {0, 1, 1.0F},
                            {0, -1, 1.0F},        {1, 1, 1.41421356F},  {-1, 1, 1.41421356F},
                            {1, -1, 1.41421356F}, {-1, -1, 1.41421356F}};

/// Filled hollows rise by about this much a cell towards their far end, so that water finds the
/// spill.
constexpr float kFillStep_m = 1e-3F;

/// In [0, 1), drawn from the cell and the direction: water on an even slope would else run along
/// the grid.
float jitter(std::size_t cell, int direction) {
  return static_cast<float>(core::random_bits(0x666c6f77, cell, static_cast<unsigned>(direction)) >>
                            40) *
         0x1.0p-24F;
}

/// Orders as the floats do; the cell in the low half breaks ties.
std::uint64_t flood_key(float height_m, std::int32_t cell) {
  const auto bits = std::bit_cast<std::uint32_t>(height_m);
  const std::uint32_t ordered = (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
  return (std::uint64_t{ordered} << 32) | static_cast<std::uint32_t>(cell);
}

}  // namespace

FlowRouting route_flow(const Grid<float>& heights_m, const std::vector<std::uint8_t>& is_outlet) {
  const int width = heights_m.width;
  const std::size_t count = heights_m.values.size();
  TERRACAST_CHECK(is_outlet.size() == count, "{} outlets for {} cells", is_outlet.size(), count);
  FlowRouting flow;
  flow.filled_m = heights_m;
  flow.order.reserve(count);
  flow.receiver.assign(count, -1);
  flow.area.assign(count, 1.0F);

  std::vector<std::uint8_t> is_queued(count, 0);
  std::priority_queue<std::uint64_t, std::vector<std::uint64_t>, std::greater<>> flood;
  for (std::size_t cell = 0; cell < count; ++cell)
    if (is_outlet[cell] != 0) {
      is_queued[cell] = 1;
      flood.push(flood_key(heights_m.values[cell], static_cast<std::int32_t>(cell)));
    }
  while (!flood.empty()) {
    const auto cell = static_cast<std::int32_t>(flood.top() & 0xffffffffU);
    flood.pop();
    flow.order.push_back(cell);
    const int i = cell % width;
    const int j = cell / width;
    const float height_m = flow.filled_m.values[static_cast<std::size_t>(cell)];
    float steepest = 0.0F;
    std::int32_t receiver = cell;
    for (int direction = 0; direction < 8; ++direction) {
      const Step& step = kSteps[direction];
      if (!heights_m.contains(i + step.di, j + step.dj)) continue;
      const std::size_t next = heights_m.index(i + step.di, j + step.dj);
      if (is_queued[next] == 0) {
        is_queued[next] = 1;
        float& filled_m = flow.filled_m.values[next];
        filled_m = std::max(filled_m, height_m + kFillStep_m * (0.1F + jitter(next, 8)));
        flood.push(flood_key(filled_m, static_cast<std::int32_t>(next)));
        continue;
      }
      // Lower cells have left the queue before: their filled heights are final.
      const float drop = (height_m - flow.filled_m.values[next]) / step.distance *
                         (0.5F + jitter(static_cast<std::size_t>(cell), direction));
      if (drop > steepest) {
        steepest = drop;
        receiver = static_cast<std::int32_t>(next);
      }
    }
    if (is_outlet[static_cast<std::size_t>(cell)] != 0) receiver = cell;
    flow.receiver[static_cast<std::size_t>(cell)] = receiver;
  }
  TERRACAST_CHECK(flow.order.size() == count, "{} of {} cells drain", flow.order.size(), count);
  for (std::size_t k = count; k-- > 0;) {
    const auto cell = static_cast<std::size_t>(flow.order[k]);
    const auto receiver = static_cast<std::size_t>(flow.receiver[cell]);
    if (receiver != cell) flow.area[receiver] += flow.area[cell];
  }
  return flow;
}

}  // namespace terracast::tiler
