#include "export/world/ground_baker.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/srgb.h"

namespace terracast::world_export {
namespace {

using scene::kLanes;

constexpr double kImageryBytes = 256.0 * 1024 * 1024;
/// Parts along a side of a square in which paint ends.
constexpr int kParts = 4;

double part_offset_m(int part, double width_m) { return ((part + 0.5) / kParts - 0.5) * width_m; }

bool is_alike(const world::PaintSample& a, const world::PaintSample& b) {
  return a.is_painted == b.is_painted && (!a.is_painted || a.coating == b.coating);
}

/// Whether something painted ends within a square.
bool has_edge(const GroundBaker::Square& square) {
  if (!square.ground->is_painted()) return false;
  world::PaintSample first;
  world::PaintSample other;
  for (int v = 0; v < kParts; ++v)
    for (int u = 0; u < kParts; ++u) {
      world::PaintSample& here = u == 0 && v == 0 ? first : other;
      square.ground->find_paint(square.center_world.x() + part_offset_m(u, square.width_m),
                                square.center_world.y() + part_offset_m(v, square.width_m), here);
      if (&here == &other && !is_alike(first, other)) return true;
    }
  return false;
}

}  // namespace

/// Places that are looked at together; their colours go to the squares whose they are.
class GroundBaker::Batch {
 public:
  Batch(const GroundBaker& baker, std::vector<scene::Color>& sums) : baker_(baker), sums_(sums) {}

  void add(std::size_t square, const TileGround::Place& place, double footprint_m) {
    set(num_, place, footprint_m);
    squares_[static_cast<std::size_t>(num_)] = square;
    if (++num_ == kLanes) {
      look();
    } else {
      // Lanes without a place of their own take any other's.
      last_ = place;
      last_footprint_m_ = footprint_m;
    }
  }
  void finish() {
    if (num_ == 0) return;
    for (int lane = num_; lane < kLanes; ++lane) set(lane, last_, last_footprint_m_);
    look();
  }

 private:
  void set(int lane, const TileGround::Place& place, double footprint_m) {
    places_.set(lane, place.point_world, place.normal_world, place.surface, footprint_m);
  }
  void look() {
    baker_.ground_.set(places_, packet_);
    baker_.ground_.look(packet_, look_);
    baker_.imagery_.drape(places_, packet_, baker_.ground_.climate().seed, reader_, look_);
    for (int lane = 0; lane < num_; ++lane)
      sums_[squares_[static_cast<std::size_t>(lane)]] +=
          scene::Color(look_.albedo[0][lane], look_.albedo[1][lane], look_.albedo[2][lane]);
    num_ = 0;
  }

  const GroundBaker& baker_;
  std::vector<scene::Color>& sums_;
  int num_ = 0;
  std::array<std::size_t, kLanes> squares_{};
  TileGround::Place last_;
  double last_footprint_m_ = 1.0;
  scene::GroundPlaces places_;
  scene::GroundPacket packet_;
  scene::GroundLook look_;
  scene::GroundImagery::Reader reader_;
};

GroundBaker::GroundBaker(const world::TileStore& store)
    : ground_(scene::climate_of(store,
                                static_cast<std::uint32_t>(core::mix_bits(store.manifest().seed)))),
      imagery_(store, kImageryBytes) {}

void GroundBaker::bake(std::span<const Square> squares, std::span<Code> codes) const {
  std::vector<scene::Color> sums(squares.size(), scene::Color::Zero());
  Batch batch(*this, sums);
  std::vector<float> share(squares.size(), 1.0F);
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const Square& square = squares[i];
    if (square.ground == nullptr) continue;
    const Eigen::Vector2d& center = square.center_world;
    if (!has_edge(square)) {
      batch.add(i, square.ground->at(center.x(), center.y()), square.width_m);
      continue;
    }
    share[i] = 1.0F / (kParts * kParts);
    for (int v = 0; v < kParts; ++v)
      for (int u = 0; u < kParts; ++u)
        batch.add(i,
                  square.ground->at(center.x() + part_offset_m(u, square.width_m),
                                    center.y() + part_offset_m(v, square.width_m)),
                  square.width_m / kParts);
  }
  batch.finish();
  for (std::size_t i = 0; i < squares.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      codes[i][c] = core::srgb8_from_linear(share[i] * sums[i][static_cast<int>(c)]);
}

core::Image8 GroundBaker::picture_of(const TileGround& ground, int side_px) const {
  core::Image8 picture(side_px, side_px, 3);
  const double pixel_m = ground.tile().id.side_m() / side_px;
  const Eigen::Vector2d corner = ground.tile().id.corner_world();
  core::parallel_for(side_px, [&](std::int64_t row) {
    std::vector<Square> squares(static_cast<std::size_t>(side_px));
    std::vector<Code> codes(squares.size());
    for (std::size_t i = 0; i < squares.size(); ++i)
      squares[i] = {
          .ground = &ground,
          .center_world = corner + Eigen::Vector2d(static_cast<double>(i) + 0.5,
                                                   static_cast<double>(side_px - row) - 0.5) *
                                       pixel_m,
          .width_m = pixel_m};
    bake(squares, codes);
    std::uint8_t* out = picture.row(static_cast<int>(row)).data();
    for (const Code& code : codes) out = std::copy(code.begin(), code.end(), out);
  });
  return picture;
}

}  // namespace terracast::world_export
