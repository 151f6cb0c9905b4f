#include "tiler/buildings/building_mesh.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "tiler/buildings/building_draws.h"
#include "tiler/buildings/roof_measures.h"
#include "tiler/buildings/roof_things.h"
#include "tiler/buildings/setback.h"
#include "tiler/buildings/shape_builder.h"
#include "tiler/buildings/sound_shape.h"
#include "tiler/roofs/triangulation.h"
#include "world/facade.h"

// A building is one surface: walls round the footprint, a bottom below the ground, and over the
// walls a roof that is a height above each point. Eaves add a soffit and a fascia between walls and
// roof; what stands on a roof is a hole in it with walls round it and a top, so that nothing
// crosses anything.
namespace terracast::tiler {
namespace {

using core::random_between;
using core::random_unit;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;
using world::kHeightStep_m;

using Triangles = std::vector<std::array<int, 3>>;
using Edges = std::vector<std::array<int, 2>>;

/// Triangles narrower than this may turn over when their corners are rounded in the world.
constexpr double kNarrowest_steps = 4.0;
constexpr double kParapetWidth_m = 0.3;
/// Least height of walls under a roof.
constexpr double kLeastWall_m = 2.0;

/// Walls narrower than this share of a bay have no windows.
constexpr double kNarrowestBay = 0.6;

/// Triangles of the area within edges that close; nothing where any would be too narrow.
std::optional<Triangles> sound_triangles(const std::vector<Vector2i>& points, const Edges& border,
                                         const Edges& edges) {
  std::optional<Triangles> triangles = triangulate(points, border, edges);
  if (!triangles || triangles->empty()) return std::nullopt;
  for (const auto& corners : *triangles) {
    double longest = 0.0;
    std::array<Vector2d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = points[static_cast<std::size_t>(corners[k])].cast<double>();
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (at[(k + 1) % 3] - at[k]).norm());
    const Vector2d u = at[1] - at[0];
    const Vector2d v = at[2] - at[0];
    if (u.x() * v.y() - u.y() * v.x() < kNarrowest_steps * longest) return std::nullopt;
  }
  return triangles;
}

struct Border {
  std::vector<Vector2i> points;
  Edges edges;

  void add(std::span<const Vector2i> ring) {
    const int first = static_cast<int>(points.size());
    const int n = static_cast<int>(ring.size());
    points.insert(points.end(), ring.begin(), ring.end());
    for (int i = 0; i < n; ++i) edges.push_back({first + i, first + (i + 1) % n});
  }
  void add(const RingsSteps& rings) {
    for (const auto& ring : rings) add(ring);
  }
};

class BuildingBuilder {
 public:
  BuildingBuilder(const BuildingPlan& plan)
      : plan_(plan), design_(*plan.design), shape_(plan.world_from_level) {
    wall_ = shape_.add_finish(design_.wall);
    roofing_ = shape_.add_finish(design_.roofing);
    trim_ = shape_.add_finish(design_.trim);
    is_raised_ = design_.bottom_m > 0.0;
    bottom_ = is_raised_
                  ? steps(design_.bottom_m - design_.footing_m - kBodySunk_m) - plan.setback_steps
                  : -plan.foundation_steps;
    const double clear = is_raised_ ? steps(design_.bottom_m + 0.5)
                                    : plan.highest_ground_steps + steps(kClearOfGround_m);
    top_ = std::max(steps(design_.top_m), clear) - plan.setback_steps;
  }

  bool add_flat(bool is_fine) {
    const RingsSteps& rings = plan_.rings;
    if (!add_bottom()) return false;
    const bool is_small = area_m2(rings) < 30.0;
    std::optional<RingsSteps> inner;
    if (is_fine && !is_small) inner = moved_edges(rings, -steps(kParapetWidth_m));
    if (inner) {
      const double parapet = steps(parapet_m(plan_.own));
      Border rim;
      rim.add(rings);
      rim.add(*inner);
      std::vector<OnRoof> things =
          plant_on(*inner, design_, plan_.own, top_ - parapet, finish_of());
      std::optional<Triangles> around = sound_triangles(rim.points, rim.edges, {});
      std::optional<Triangles> floor = floor_under(*inner, things);
      if (!floor && !things.empty()) {
        things.clear();
        floor = floor_under(*inner, things);
      }
      if (around && floor) {
        for (const auto& corners : *around) add_level(rim.points, corners, top_, trim_);
        Border inside;
        inside.add(*inner);
        for (const OnRoof& thing : things) inside.add(thing.ring);
        for (const auto& corners : *floor)
          add_level(inside.points, corners, top_ - parapet, roofing_);
        for (const auto& ring : *inner)
          for (std::size_t i = 0; i < ring.size(); ++i)
            shape_.wall_quad(ring[(i + 1) % ring.size()].cast<double>(), ring[i].cast<double>(),
                             top_ - parapet, top_, trim_);
        for (const OnRoof& thing : things) add_thing(thing);
        add_walls(top_, top_ - parapet);
        return true;
      }
    }
    Border border;
    border.add(rings);
    const std::optional<Triangles> floor = triangulate(border.points, border.edges, {});
    if (!floor) return false;
    for (const auto& corners : *floor) add_level(border.points, corners, top_, roofing_);
    add_walls(top_, top_);
    return true;
  }

  bool add_pitched(bool is_fine) {
    const RingsSteps& rings = plan_.rings;
    RoofOptions options = roof_options();
    const double least_wall = is_raised_ ? steps(0.15) : steps(kLeastWall_m);
    const double from = is_raised_ ? bottom_ + steps(design_.footing_m) : 0.0;
    options.most_steps = std::min(options.most_steps, top_ - from - least_wall);
    if (options.most_steps < steps(0.3)) return false;
    if (options.shape == RoofShape::Gabled || options.shape == RoofShape::HalfHipped ||
        options.shape == RoofShape::Gambrel || options.shape == RoofShape::Round)
      options.gables = gable_edges(rings, plan_.attached, options.ridge_across);
    RingsSteps eaves = rings;
    std::vector<double> by(num_corners(rings), 0.0);
    double fascia = 0.0;
    std::optional<Roof> roof;
    if (is_fine && !is_raised_ && design_.kind != BuildingKind::Greenhouse) {
      const double overhang =
          steps(kEaves_m * random_between(0.6, kMostOverhang, plan_.own, 0, kOverhang) *
                (design_.kind == BuildingKind::Garage ? 0.5 : 1.0));
      for (std::size_t i = 0; i < by.size(); ++i) {
        const bool is_gable = i < options.gables.size() && options.gables[i] &&
                              options.shape != RoofShape::HalfHipped;
        by[i] = is_gable || (i < plan_.attached.size() && plan_.attached[i]) ? 0.0 : overhang;
      }
      if (const auto moved = moved_edges(rings, by)) {
        roof = make_roof(*moved, options);
        if (roof && roof_triangles(*roof, *moved, {})) {
          eaves = *moved;
          fascia = steps(kFascia_m);
        } else {
          roof.reset();
        }
      }
      if (!roof) std::fill(by.begin(), by.end(), 0.0);
    }
    if (!roof) roof = make_roof(rings, options);
    if (!roof) return false;
    std::vector<OnRoof> things;
    const double eaves_height = top_ - roof->highest_steps() - fascia;
    if (is_fine)
      things =
          chimneys_on(*roof, plan_.rings, design_, plan_.own, eaves_height + fascia, finish_of());
    std::optional<Triangles> triangles = roof_triangles(*roof, eaves, things);
    if (!triangles && !things.empty()) {
      things.clear();
      triangles = roof_triangles(*roof, eaves, things);
    }
    if (!triangles || !add_bottom()) return false;

    Border points;
    points.points = roof->points_steps;
    for (const OnRoof& thing : things) points.add(thing.ring);
    std::vector<double> heights;
    for (const double rise : roof->rises_steps) heights.push_back(eaves_height + fascia + rise);
    for (const OnRoof& thing : things)
      heights.insert(heights.end(), thing.foot_steps.begin(), thing.foot_steps.end());
    for (const auto& corners : *triangles) {
      std::array<Vector3d, 3> at;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(corners[k]);
        at[k] = at_height(points.points[i], heights[i]);
      }
      shape_.surface(at[0], at[1], at[2], roofing_);
    }
    for (const OnRoof& thing : things) add_thing(thing);
    return add_walls_under(*roof, eaves, by, eaves_height, fascia, heights);
  }

  /// A slab on posts.
  bool add_canopy() {
    const RingsSteps& rings = plan_.rings;
    Border border;
    border.add(rings);
    const std::optional<Triangles> top = triangulate(border.points, border.edges, {});
    if (!top) return false;
    const double under = top_ - steps(0.35);
    const std::vector<OnRoof> posts = posts_in(rings);
    Border below;
    below.add(rings);
    for (const OnRoof& post : posts) below.add(post.ring);
    const std::optional<Triangles> bottom = sound_triangles(below.points, below.edges, {});
    if (!bottom) return false;
    for (const auto& corners : *top) add_level(border.points, corners, top_, roofing_);
    for (const auto& corners : *bottom)
      add_level(below.points, {corners[0], corners[2], corners[1]}, under, trim_);
    for (const auto& ring : rings)
      for (std::size_t i = 0; i < ring.size(); ++i)
        shape_.wall_quad(ring[i].cast<double>(), ring[(i + 1) % ring.size()].cast<double>(), under,
                         top_, trim_);
    for (const OnRoof& post : posts) add_post(post, under);
    return true;
  }

  /// Few corners, as large and as high.
  void add_block() {
    const RingsSteps block = block_of(plan_.rings);
    double high = top_;
    // A pitched roof fills half of its box.
    if (design_.roof != RoofShape::Flat) {
      const Rectangle box = rectangle_round(block.front());
      const double rise = design_.roof_height_m > 0.0 ? steps(design_.roof_height_m)
                                                      : 0.5 * box.width_steps * design_.roof_slope;
      high =
          std::max(top_ - 0.45 * std::min(rise, 0.6 * top_), std::max(0.5 * top_, bottom_ + 512.0));
      if (!is_raised_) high = std::max(high, plan_.highest_ground_steps + steps(1.5));
    }
    if (plan_.levels_steps > 0.0) {
      const double lowered = plan_.setback_steps + plan_.lowest_ground_steps;
      high = plan_.levels_steps * std::round((high + lowered) / plan_.levels_steps) - lowered;
    }
    Border border;
    border.add(block);
    const std::optional<Triangles> floor = triangulate(border.points, border.edges, {});
    TERRACAST_CHECK(floor.has_value(), "a block of {} corners", border.points.size());
    const double low = design_.kind == BuildingKind::Canopy ? high - steps(0.35) : bottom_;
    for (const auto& corners : *floor) {
      add_level(border.points, corners, high, roofing_);
      add_level(border.points, {corners[0], corners[2], corners[1]}, low, wall_);
    }
    for (const auto& ring : block)
      for (std::size_t i = 0; i < ring.size(); ++i)
        add_wall(ring[i].cast<double>(), ring[(i + 1) % ring.size()].cast<double>(), low, high,
                 high, false);
    if (design_.kind != BuildingKind::Canopy) return;
    // Posts are bodies of their own, a step below the slab.
    for (const OnRoof& post : posts_in(block)) {
      add_post(post, low - 1.0);
      const std::vector<Vector2i> points(post.ring.begin(), post.ring.end());
      add_level(points, {0, 1, 2}, low - 1.0, wall_);
      add_level(points, {0, 2, 3}, low - 1.0, wall_);
    }
  }

  world::Shape take() { return shape_.take(); }

 private:
  /// Of a canopy, at the corners of its rings.
  std::vector<OnRoof> posts_in(const RingsSteps& rings) const {
    std::vector<OnRoof> posts;
    if (is_raised_) return posts;
    const auto inner = moved_edges({rings.front()}, -steps(0.5));
    if (!inner) return posts;
    for (const Vector2i& corner : inner->front()) {
      const int half = static_cast<int>(steps(0.14));
      OnRoof post;
      post.ring = {corner + Vector2i(-half, -half), corner + Vector2i(half, -half),
                   corner + Vector2i(half, half), corner + Vector2i(-half, half)};
      const bool is_free =
          contains(rings, corner.cast<double>()) &&
          distance_to_edges(rings, corner.cast<double>()) > 2.0 * half &&
          std::all_of(posts.begin(), posts.end(), [&](const OnRoof& other) {
            return (other.ring[0] - post.ring[0]).cast<double>().norm() > steps(2.0);
          });
      if (is_free && posts.size() < 16) posts.push_back(post);
    }
    return posts;
  }

  /// Its sides and its foot.
  void add_post(const OnRoof& post, double to) {
    for (std::size_t i = 0; i < 4; ++i)
      shape_.wall_quad(post.ring[i].cast<double>(), post.ring[(i + 1) % 4].cast<double>(), bottom_,
                       to, wall_);
    const std::vector<Vector2i> points(post.ring.begin(), post.ring.end());
    add_level(points, {0, 2, 1}, bottom_, wall_);
    add_level(points, {0, 3, 2}, bottom_, wall_);
  }

  RoofOptions roof_options() const {
    RoofOptions options;
    options.shape = design_.roof;
    options.slope = design_.roof_slope;
    options.height_steps = steps(design_.roof_height_m);
    options.most_steps = steps(highest_roof_m(design_));
    options.ridge_across = design_.ridge_across;
    if (design_.roof_direction_deg) {
      const double turned = *design_.roof_direction_deg * 0.017453292519943295;
      options.fall = {std::sin(turned), std::cos(turned)};
    } else {
      const Rectangle box = rectangle_round(plan_.rings.front());
      options.fall = {-box.along.y(), box.along.x()};
      if (random_unit(plan_.own, 1, kOverhang) < 0.5) options.fall = -options.fall;
    }
    return options;
  }

  bool add_bottom() {
    Border border;
    border.add(plan_.rings);
    const std::optional<Triangles> floor = triangulate(border.points, border.edges, {});
    if (!floor) return false;
    for (const auto& corners : *floor)
      add_level(border.points, {corners[0], corners[2], corners[1]}, bottom_, wall_);
    return true;
  }

  void add_level(const std::vector<Vector2i>& points, const std::array<int, 3>& corners,
                 double height, std::uint8_t finish) {
    std::array<Vector3d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = at_height(points[static_cast<std::size_t>(corners[k])], height);
    shape_.surface(at[0], at[1], at[2], finish);
  }

  /// top   of the highest storey
  void add_walls(double high, double top) {
    std::size_t edge = 0;
    for (const auto& ring : plan_.rings)
      for (std::size_t i = 0; i < ring.size(); ++i, ++edge)
        add_wall(ring[i].cast<double>(), ring[(i + 1) % ring.size()].cast<double>(), bottom_, high,
                 top, is_attached(edge));
  }
  bool is_attached(std::size_t edge) const {
    return edge < plan_.attached.size() && plan_.attached[edge];
  }

  /// With whole bays from corner to corner, and whole storeys up to the top; blind where another
  /// house stands against it, and where there is no room for a bay.
  void add_wall(const Vector2d& a, const Vector2d& b, double low, double high, double top,
                bool is_blind) {
    const double length_m = (b - a).norm() * kHeightStep_m;
    const FacadeFit fit = fit_of(length_m, top);
    shape_.wall_quad(a, b, low, high, is_blind || fit.is_narrow ? wall_plain() : wall_, fit.scale);
  }

  struct FacadeFit {
    Vector2d scale = Vector2d::Ones();
    bool is_narrow = false;
  };
  FacadeFit fit_of(double length_m, double top) const {
    FacadeFit fit;
    const std::uint16_t pattern = design_.wall.pattern;
    if (pattern == 0 || length_m <= 0.0 || top <= 0.0) return fit;
    const double bay_m = world::facade_bay_m(static_cast<world::FacadeStyle>(pattern >> 8));
    const double wanted_m = bay_m * random_between(0.88, 1.12, plan_.own, 0, kBays);
    const double storey_m = 0.1 * (pattern & 255);
    fit.is_narrow = length_m < kNarrowestBay * wanted_m;
    fit.scale = {world::whole_parts_scale(length_m, wanted_m, bay_m),
                 world::whole_parts_scale(top * kHeightStep_m, storey_m, storey_m)};
    return fit;
  }

  std::optional<Triangles> floor_under(const RingsSteps& rings,
                                       const std::vector<OnRoof>& things) const {
    Border border;
    border.add(rings);
    for (const OnRoof& thing : things) border.add(thing.ring);
    return sound_triangles(border.points, border.edges, {});
  }

  std::optional<Triangles> roof_triangles(const Roof& roof, const RingsSteps& rings,
                                          const std::vector<OnRoof>& things) const {
    Border border;
    border.points = roof.points_steps;
    int first = 0;
    for (const auto& ring : rings) {
      const int n = static_cast<int>(ring.size());
      for (int i = 0; i < n; ++i) {
        int before = first + i;
        for (const int point : roof.gable_points[static_cast<std::size_t>(first + i)]) {
          border.edges.push_back({before, point});
          before = point;
        }
        border.edges.push_back({before, first + (i + 1) % n});
      }
      first += n;
    }
    for (const OnRoof& thing : things) border.add(thing.ring);
    return sound_triangles(border.points, border.edges, roof.edges);
  }

  void add_thing(const OnRoof& thing) {
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t j = (i + 1) % 4;
      const Vector2d a = thing.ring[i].cast<double>();
      const Vector2d b = thing.ring[j].cast<double>();
      const double length_m = (b - a).norm() * kHeightStep_m;
      const auto corner = [&](const Vector2d& at, double height, double along_m) {
        return shape_.vertex({at.x(), at.y(), height}, {along_m, height * kHeightStep_m});
      };
      const std::uint32_t a0 = corner(a, thing.foot_steps[i], 0.0);
      const std::uint32_t b0 = corner(b, thing.foot_steps[j], length_m);
      const std::uint32_t b1 = corner(b, thing.top_steps[j], length_m);
      shape_.triangle(a0, b0, b1, thing.finish);
      shape_.triangle(a0, b1, corner(a, thing.top_steps[i], 0.0), thing.finish);
    }
    std::array<Vector3d, 4> top;
    for (std::size_t i = 0; i < 4; ++i) top[i] = at_height(thing.ring[i], thing.top_steps[i]);
    shape_.surface(top[0], top[1], top[2], thing.top_finish);
    shape_.surface(top[0], top[2], top[3], thing.top_finish);
  }

  /// Finishes are added when they are first asked for.
  RoofFinishes finish_of() {
    return [this](RoofFinish finish) {
      return finish == RoofFinish::Wall    ? wall_plain()
             : finish == RoofFinish::Metal ? metal()
                                           : chimney();
    };
  }
  std::uint8_t wall_plain() {
    if (!wall_plain_) {
      world::Finish finish = design_.wall;
      finish.pattern = 0;
      wall_plain_ = shape_.add_finish(finish);
    }
    return *wall_plain_;
  }
  std::uint8_t metal() {
    if (!metal_) {
      world::Finish finish = design_.trim;
      finish.material = world::Material::Metal;
      finish.color_srgb = {172, 174, 174};
      metal_ = shape_.add_finish(finish);
    }
    return *metal_;
  }

  std::uint8_t chimney() {
    if (!chimney_) {
      world::Finish finish = design_.trim;
      const bool is_brick = random_unit(plan_.own, 1, kParapet) < 0.55;
      finish.material = is_brick ? world::Material::Brick : world::Material::Plaster;
      if (is_brick) finish.color_srgb = {148, 92, 72};
      chimney_ = shape_.add_finish(finish);
    }
    return *chimney_;
  }

  /// Walls up to the eaves, soffits and fascias beyond them, gables.
  bool add_walls_under(const Roof& roof, const RingsSteps& eaves, const std::vector<double>& by,
                       double eaves_height, double fascia, const std::vector<double>& heights) {
    int first = 0;
    for (std::size_t r = 0; r < eaves.size(); ++r) {
      const int n = static_cast<int>(eaves[r].size());
      for (int i = 0; i < n; ++i) {
        const auto edge = static_cast<std::size_t>(first + i);
        const auto here = static_cast<std::size_t>(i);
        const auto there = static_cast<std::size_t>((i + 1) % n);
        const Vector2i p0 = plan_.rings[r][here];
        const Vector2i p1 = plan_.rings[r][there];
        const Vector2i q0 = eaves[r][here];
        const Vector2i q1 = eaves[r][there];
        if (by[edge] > 0.0) {
          add_wall(p0.cast<double>(), p1.cast<double>(), bottom_, eaves_height, eaves_height,
                   is_attached(edge));
          const std::vector<Vector2i> strip = {p0, p1, q1, q0};
          add_level(strip, {0, 1, 2}, eaves_height, trim_);
          add_level(strip, {0, 2, 3}, eaves_height, trim_);
          shape_.wall_quad(q0.cast<double>(), q1.cast<double>(), eaves_height,
                           eaves_height + fascia, trim_);
          continue;
        }
        // Up to the eaves as the others; the gable over them, in its own plane: along it, and up.
        add_wall(p0.cast<double>(), p1.cast<double>(), bottom_, eaves_height, eaves_height,
                 is_attached(edge));
        std::vector<Vector3d> outline = {at_height(p0, eaves_height), at_height(p1, eaves_height)};
        const auto add_corner = [&](const Vector3d& corner) {
          if (corner != outline.back() && corner != outline.front()) outline.push_back(corner);
        };
        add_corner(at_height(q1, eaves_height));
        add_corner(at_height(q1, heights[static_cast<std::size_t>(first + (i + 1) % n)]));
        const auto& gable = roof.gable_points[edge];
        for (std::size_t k = gable.size(); k-- > 0;) {
          const auto point = static_cast<std::size_t>(gable[k]);
          add_corner(at_height(roof.points_steps[point], heights[point]));
        }
        add_corner(at_height(q0, heights[edge]));
        add_corner(at_height(q0, eaves_height));
        if (outline.size() < 3) continue;
        const Vector2d along = (p1 - p0).cast<double>().normalized();
        std::vector<Vector2i> flat;
        for (const Vector3d& corner : outline)
          flat.emplace_back(
              static_cast<int>(std::lround(along.dot(corner.head<2>() - p0.cast<double>()))),
              static_cast<int>(std::lround(corner.z())));
        Border border;
        border.add(flat);
        const std::optional<Triangles> triangles = triangulate(border.points, border.edges, {});
        if (!triangles) return false;
        const Vector2d scale =
            kHeightStep_m *
            fit_of((p1 - p0).cast<double>().norm() * kHeightStep_m, eaves_height).scale;
        for (const auto& corners : *triangles) {
          std::array<std::uint32_t, 3> at = {};
          for (std::size_t k = 0; k < 3; ++k) {
            const auto c = static_cast<std::size_t>(corners[k]);
            at[k] = shape_.vertex(outline[c], scale.cwiseProduct(flat[c].cast<double>()));
          }
          shape_.triangle(at[0], at[1], at[2], wall_plain());
        }
      }
      first += n;
    }
    return true;
  }

  const BuildingPlan& plan_;
  const BuildingDesign& design_;
  ShapeBuilder shape_;
  std::uint8_t wall_ = 0;
  std::uint8_t roofing_ = 0;
  std::uint8_t trim_ = 0;
  std::optional<std::uint8_t> wall_plain_;
  std::optional<std::uint8_t> metal_;
  std::optional<std::uint8_t> chimney_;
  bool is_raised_ = false;
  double bottom_ = 0.0;
  double top_ = 0.0;
};

/// With a roof of that shape; nullopt: it does not fit the footprint.
std::optional<world::Shape> pitched_shape(const BuildingPlan& plan, RoofShape roof, bool is_fine) {
  BuildingDesign design = *plan.design;
  if (design.roof != roof) design.roof_slope = std::min(design.roof_slope, 0.6);
  design.roof = roof;
  BuildingPlan other = plan;
  other.design = &design;
  BuildingBuilder builder(other);
  if (!builder.add_pitched(is_fine)) return std::nullopt;
  world::Shape shape = builder.take();
  return is_sound(shape) ? std::optional(std::move(shape)) : std::nullopt;
}

}  // namespace

bool bears_its_roof(const BuildingPlan& plan) {
  const RoofShape roof = plan.design->roof;
  if (roof == RoofShape::Flat) return true;
  return plan.design->kind != BuildingKind::Canopy && pitched_shape(plan, roof, false).has_value();
}

world::Shape building_shape(const BuildingPlan& plan, BuildingDetail detail) {
  const bool is_fine = detail == BuildingDetail::Fine;
  // From what is asked for to what always works.
  if (detail != BuildingDetail::Block) {
    if (plan.design->kind == BuildingKind::Canopy) {
      BuildingBuilder builder(plan);
      if (builder.add_canopy())
        if (world::Shape shape = builder.take(); is_sound(shape)) return shape;
    } else if (plan.design->roof != RoofShape::Flat) {
      std::vector<RoofShape> shapes = {plan.design->roof};
      if (plan.design->roof != RoofShape::Hipped) shapes.push_back(RoofShape::Hipped);
      for (const RoofShape roof : shapes)
        for (const bool with_details : {true, false}) {
          if (with_details && !is_fine) continue;
          if (auto shape = pitched_shape(plan, roof, with_details)) return *std::move(shape);
        }
    }
    for (const bool with_details : {true, false}) {
      if (with_details && !is_fine) continue;
      BuildingBuilder builder(plan);
      if (builder.add_flat(with_details))
        if (world::Shape shape = builder.take(); is_sound(shape)) return shape;
    }
  }
  BuildingBuilder builder(plan);
  builder.add_block();
  return builder.take();
}

}  // namespace terracast::tiler
