#include "validate/oracle_pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

#include "core/parallel.h"
#include "core/random.h"

namespace terracast::validate {
namespace {

using oracle::ExactHit;
using oracle::ExactWorld;
using oracle::TileSurface;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kShift_px = 1e-3;
constexpr double kGrazingSine = 0.05;
constexpr double kNearEdge_px = 0.01;
/// Ratio of depths between pixels side by side from which they show two surfaces.
constexpr double kJump = 1.05;
constexpr int kReach_px = 16;  ///< between pixels of which the jump is looked for; a power of two
constexpr int kWindow = 6;     ///< cells around a hit whose corners and edges are looked at

/// How unlike two pixels' depths are, 1 or more; +inf for ground beside sky.
double jump_between(const std::optional<ExactHit>& a, const std::optional<ExactHit>& b) {
  if (!a && !b) return 1.0;
  if (!a || !b) return kInfinity;
  return std::max(a->t / b->t, b->t / a->t);
}

double distance_to_segment(const Eigen::Vector2d& point, const Eigen::Vector2d& from,
                           const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double square = along.squaredNorm();
  const double share =
      square > 0.0 ? std::clamp((point - from).dot(along) / square, 0.0, 1.0) : 0.0;
  return (point - from - share * along).norm();
}

class Chooser {
 public:
  Chooser(const ExactWorld& terrain, const OracleView& view, std::int64_t count, std::int64_t seed)
      : terrain_(terrain),
        view_(view),
        count_(static_cast<std::size_t>(count)),
        seed_(static_cast<std::uint64_t>(seed)),
        stream_(core::stream_of(
            core::stream_of(1ULL << 44, static_cast<std::uint64_t>(view.view.camera_index)),
            static_cast<std::uint64_t>(view.view.frame))),
        width_(view.intrinsics().width_px),
        height_(view.intrinsics().height_px) {}

  OraclePixels run() {
    for (std::size_t i = 0; i < count_; ++i) {
      const auto [x, y] = draw_pixel();
      add(x, y, PixelReason::Random);
    }
    cast(0);
    chosen_.kinds.num_random = static_cast<std::int64_t>(count_);
    const std::size_t first_other = chosen_.pixels.size();
    const std::size_t share = (count_ + 3) / 4;
    add_grazing(share);
    add_near_edges(share);
    add_borders(share);
    add_silhouettes(share);
    cast(first_other);
    find_silhouettes();
    for (const OraclePixel& pixel : chosen_.pixels) count_kinds(pixel);
    return std::move(chosen_);
  }

 private:
  std::uint64_t draw_bits() { return core::random_bits(seed_, stream_, num_drawn_++); }
  int draw(int size) {
    return static_cast<int>(draw_bits() % static_cast<std::uint64_t>(std::max(size, 1)));
  }
  /// One into which a ray comes, as long as there are more than a few.
  std::array<int, 2> draw_pixel() {
    constexpr int kTries = 100;
    std::array<int, 2> pixel{};
    for (int i = 0; i < kTries; ++i) {
      const int x = draw(width_);
      pixel = {x, draw(height_)};
      if (view_.has_ray({pixel[0] + 0.5, pixel[1] + 0.5})) break;
    }
    return pixel;
  }
  bool is_inside(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  void add(int x, int y, PixelReason reason) {
    chosen_.pixels.push_back({.x = x, .y = y, .reason = reason, .hit = std::nullopt});
  }

  std::optional<ExactHit> hit_at(const Eigen::Vector2d& place) const {
    if (!view_.has_ray(place)) return std::nullopt;
    return terrain_.first_hit(view_.ray(place));
  }

  template <class Work>
  static void for_all(std::size_t count, const Work& work) {
    constexpr std::int64_t kGrain = 8;
    core::parallel_for_blocks(
        static_cast<std::int64_t>(count), kGrain, [&](std::int64_t begin, std::int64_t end) {
          for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
            work(i);
        });
  }

  void cast(std::size_t first) {
    for_all(chosen_.pixels.size() - first, [&](std::size_t i) {
      OraclePixel& pixel = chosen_.pixels[first + i];
      pixel.hit = hit_at(pixel.center());
    });
  }

  /// The random pixels that hit the ground.
  std::vector<std::size_t> ground_pixels() const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < count_; ++i)
      if (chosen_.pixels[i].hit && !chosen_.pixels[i].hit->object) found.push_back(i);
    return found;
  }

  // Neighbours of the pixels whose rays graze most.
  void add_grazing(std::size_t count) {
    std::vector<std::pair<double, std::size_t>> by_sine;
    for (const std::size_t i : ground_pixels())
      by_sine.emplace_back(view_.sine_of_graze(chosen_.pixels[i].center(), *chosen_.pixels[i].hit),
                           i);
    std::sort(by_sine.begin(), by_sine.end());
    for (std::size_t k = 0; k < std::min(count, by_sine.size()); ++k) {
      const OraclePixel at = chosen_.pixels[by_sine[k].second];
      const int x = at.x + draw(3) - 1;
      const int y = at.y + draw(3) - 1;
      if (is_inside(x, y)) add(x, y, PixelReason::Grazing);
    }
  }

  // Corners and edges of the triangles around some hits, those that come nearest to a pixel's centre.
  void add_near_edges(std::size_t count) {
    const std::vector<std::size_t> ground = ground_pixels();
    if (ground.empty()) return;
    struct Candidate {
      double distance_px;
      int x, y;
      bool operator<(const Candidate& other) const {
        return std::tuple(distance_px, y, x) < std::tuple(other.distance_px, other.y, other.x);
      }
    };
    std::vector<std::size_t> around;
    for (std::size_t k = 0; k < count; ++k)
      around.push_back(ground[static_cast<std::size_t>(draw(static_cast<int>(ground.size())))]);
    std::vector<std::array<Candidate, 2>> nearest(around.size());
    for_all(around.size(), [&](std::size_t k) {
      const ExactHit& hit = *chosen_.pixels[around[k]].hit;
      const std::shared_ptr<const TileSurface> surface = terrain_.surface(hit.tile);
      Candidate corner{kInfinity, -1, -1};
      Candidate edge = corner;
      const auto place = [&](int i, int j) {
        return i <= TileSurface::kCells && j <= TileSurface::kCells
                   ? view_.project(surface->vertex_world(i, j))
                   : std::nullopt;
      };
      const auto look = [&](const Eigen::Vector2d& at, const Eigen::Vector2d& from,
                            const Eigen::Vector2d& to, Candidate& best) {
        if (!view_.intrinsics().contains(at)) return;
        const int x = static_cast<int>(at.x());
        const int y = static_cast<int>(at.y());
        best = std::min(best, {distance_to_segment({x + 0.5, y + 0.5}, from, to), x, y});
      };
      for (int j = std::max(hit.cell_y - kWindow, 0);
           j <= std::min(hit.cell_y + kWindow, TileSurface::kCells); ++j)
        for (int i = std::max(hit.cell_x - kWindow, 0);
             i <= std::min(hit.cell_x + kWindow, TileSurface::kCells); ++i) {
          const auto here = place(i, j);
          if (!here) continue;
          look(*here, *here, *here, corner);
          for (const auto& other :
               {place(i + 1, j), place(i, j + 1), i > 0 ? place(i - 1, j + 1) : std::nullopt})
            if (other) look(0.5 * (*here + *other), *here, *other, edge);
        }
      nearest[k] = {corner, edge};
    });
    // Half of them by corners, half by edges: of these many more come near.
    for (std::size_t kind = 0; kind < 2; ++kind) {
      std::vector<Candidate> candidates;
      for (const auto& pair : nearest)
        if (pair[kind].x >= 0) candidates.push_back(pair[kind]);
      std::sort(candidates.begin(), candidates.end());
      for (std::size_t k = 0; k < std::min((count + 1) / 2, candidates.size()); ++k)
        add(candidates[k].x, candidates[k].y, PixelReason::NearEdge);
    }
  }

  /// Whether a hit lies in a cell at the border of its tile, and whether levels change there.
  struct BorderKind {
    bool is_border = false;
    bool is_level_change = false;
  };
  BorderKind border_of(const ExactHit& hit) const {
    constexpr int kLast = TileSurface::kCells - 1;
    const std::array<bool, 4> is_at = {hit.cell_x == 0, hit.cell_x == kLast, hit.cell_y == 0,
                                       hit.cell_y == kLast};
    const std::array<int, 4> levels = terrain_.neighbour_levels(hit.tile);
    BorderKind kind;
    for (std::size_t side = 0; side < 4; ++side) {
      kind.is_border = kind.is_border || is_at[side];
      kind.is_level_change = kind.is_level_change || (is_at[side] && levels[side] != 0);
    }
    return kind;
  }

  // Samples on the borders of tiles that are hit, where levels change if that can be seen.
  void add_borders(std::size_t count) {
    const std::vector<std::size_t> ground = ground_pixels();
    if (ground.empty()) return;
    std::vector<std::array<int, 2>> found(count, {-1, -1});
    const std::uint64_t first_draw = num_drawn_;
    for_all(count, [&](std::size_t k) {
      const std::uint64_t stream = core::stream_of(stream_, first_draw + k);
      std::uint64_t num_drawn = 0;
      const auto draw_of = [&](std::size_t size) {
        return static_cast<int>(core::random_bits(seed_, stream, num_drawn++) % size);
      };
      constexpr int kTries = 64;
      constexpr int kMostRays = 8;
      constexpr std::size_t kAlong = 64;  // cells from the hit, so that the sample is in the image
      int num_rays = 0;
      for (int attempt = 0; attempt < kTries && num_rays < kMostRays; ++attempt) {
        const std::size_t at = ground[static_cast<std::size_t>(draw_of(ground.size()))];
        const ExactHit& hit = *chosen_.pixels[at].hit;
        const int side = draw_of(4);
        const bool is_level_wanted = attempt < 3 * kTries / 4;
        if (is_level_wanted &&
            terrain_.neighbour_levels(hit.tile)[static_cast<std::size_t>(side)] == 0)
          continue;
        const int near = side < 2 ? hit.cell_y : hit.cell_x;
        const int along = std::clamp(near + draw_of(2 * kAlong) - static_cast<int>(kAlong), 0,
                                     static_cast<int>(TileSurface::kCells));
        const int i = side == 0 ? 0 : side == 1 ? TileSurface::kCells : along;
        const int j = side == 2 ? 0 : side == 3 ? TileSurface::kCells : along;
        const auto place = view_.project(terrain_.surface(hit.tile)->vertex_world(i, j));
        if (!place || !view_.intrinsics().contains(*place)) continue;
        const std::array<int, 2> pixel = {static_cast<int>(place->x()),
                                          static_cast<int>(place->y())};
        ++num_rays;  // it may be hidden
        const auto seen = hit_at({pixel[0] + 0.5, pixel[1] + 0.5});
        const BorderKind kind = seen && !seen->object ? border_of(*seen) : BorderKind{};
        if (kind.is_border && (found[k][0] < 0 || kind.is_level_change)) found[k] = pixel;
        if (kind.is_level_change) return;
      }
    });
    for (const auto& pixel : found)
      if (pixel[0] >= 0) add(pixel[0], pixel[1], PixelReason::Border);
  }

  // Between two pixels whose depths differ most for their distance there is a silhouette: halving
  // leads to the pixels on both of its sides.
  void add_silhouettes(std::size_t count) {
    struct Pair {
      double jump = 1.0;
      OraclePixel a, b;
    };
    std::vector<Pair> pairs(count_);
    std::vector<bool> is_across(count_);
    for (std::size_t i = 0; i < count_; ++i) is_across[i] = (draw_bits() & 1) != 0;
    for_all(count_, [&](std::size_t i) {
      const OraclePixel& a = chosen_.pixels[i];
      OraclePixel b = a;
      (is_across[i] ? b.x : b.y) += kReach_px;
      if (!is_inside(b.x, b.y)) return;
      b.hit = hit_at(b.center());
      pairs[i] = {jump_between(a.hit, b.hit), a, b};
    });
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& p, const Pair& q) { return p.jump > q.jump; });
    // Each gives two pixels.
    pairs.resize(std::min(pairs.size(), (count + 1) / 2));
    for_all(pairs.size(), [&](std::size_t i) {
      Pair& pair = pairs[i];
      while (pair.jump > kJump && std::max(pair.b.x - pair.a.x, pair.b.y - pair.a.y) > 1) {
        OraclePixel middle{.x = (pair.a.x + pair.b.x) / 2,
                           .y = (pair.a.y + pair.b.y) / 2,
                           .reason = pair.a.reason,
                           .hit = {}};
        middle.hit = hit_at(middle.center());
        const double before = jump_between(pair.a.hit, middle.hit);
        const double after = jump_between(middle.hit, pair.b.hit);
        (before >= after ? pair.b : pair.a) = middle;
        pair.jump = std::max(before, after);
      }
    });
    for (const Pair& pair : pairs) {
      if (!(pair.jump > kJump)) continue;
      add(pair.a.x, pair.a.y, PixelReason::Silhouette);
      add(pair.b.x, pair.b.y, PixelReason::Silhouette);
      chosen_.kinds.num_beside_silhouette += 2;
    }
  }

  void find_silhouettes() {
    for_all(chosen_.pixels.size(), [&](std::size_t i) {
      OraclePixel& pixel = chosen_.pixels[i];
      for (const Eigen::Vector2d& shift :
           {Eigen::Vector2d(-kShift_px, 0.0), Eigen::Vector2d(kShift_px, 0.0),
            Eigen::Vector2d(0.0, -kShift_px), Eigen::Vector2d(0.0, kShift_px)})
        if (is_other_surface(pixel, pixel.center() + shift)) {
          pixel.is_on_silhouette = true;
          return;
        }
    });
  }

  /// The parameter at which the ray through an image point meets the plane of a hit; +inf where it
  /// does not.
  double parameter_on_plane(const Eigen::Vector2d& place, const ExactHit& hit) const {
    const oracle::ExactRay ray = view_.ray(place);
    const double speed = hit.normal_world.dot(ray.through_world - ray.origin_world);
    const double t = hit.normal_world.dot(hit.corners_world[0] - ray.origin_world) / speed;
    return speed < 0.0 ? t : kInfinity;
  }

  /// Whether the depth between a pixel and a place beside it changes by more than twice what the
  /// steeper of the two triangles' planes does: on one surface it changes along its triangles, which
  /// are either of the two or lie between them.
  bool is_other_surface(const OraclePixel& pixel, const Eigen::Vector2d& place) const {
    const std::optional<ExactHit> beside = hit_at(place);
    if (!pixel.hit || !beside) return pixel.hit.has_value() != beside.has_value();
    const double t = pixel.hit->t;
    const double change = std::abs(beside->t - t);
    const double along_this = std::abs(parameter_on_plane(place, *pixel.hit) - t);
    const double along_that = std::abs(beside->t - parameter_on_plane(pixel.center(), *beside));
    // Rounding of the planes' parameters in double.
    const double least = 1e-12 * t;
    return change > 2.0 * std::max(along_this, along_that) + least;
  }

  void count_kinds(const OraclePixel& pixel) {
    PixelKinds& kinds = chosen_.kinds;
    if (!pixel.hit) {
      ++kinds.num_sky;
      return;
    }
    const ExactHit& hit = *pixel.hit;
    if (view_.sine_of_graze(pixel.center(), hit) < kGrazingSine) ++kinds.num_grazing;
    double nearest_px = kInfinity;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto from = view_.project(hit.corners_world[k]);
      const auto to = view_.project(hit.corners_world[(k + 1) % 3]);
      if (from && to)
        nearest_px = std::min(nearest_px, distance_to_segment(pixel.center(), *from, *to));
    }
    if (nearest_px < kNearEdge_px) ++kinds.num_near_edge;
    if (hit.object) {
      ++kinds.num_object;
      return;
    }
    const auto [is_border, is_level_change] = border_of(hit);
    kinds.num_border += is_border ? 1 : 0;
    kinds.num_level_change += is_level_change ? 1 : 0;
  }

  const ExactWorld& terrain_;
  const OracleView& view_;
  std::size_t count_;
  std::uint64_t seed_, stream_;
  std::uint64_t num_drawn_ = 0;
  int width_, height_;
  OraclePixels chosen_;
};

}  // namespace

void PixelKinds::add(const PixelKinds& other) {
  num_random += other.num_random;
  num_sky += other.num_sky;
  num_grazing += other.num_grazing;
  num_near_edge += other.num_near_edge;
  num_border += other.num_border;
  num_level_change += other.num_level_change;
  num_object += other.num_object;
  num_beside_silhouette += other.num_beside_silhouette;
}

OraclePixels choose_pixels(const ExactWorld& terrain, const OracleView& view, std::int64_t count,
                           std::int64_t seed) {
  return Chooser(terrain, view, count, seed).run();
}

}  // namespace terracast::validate
