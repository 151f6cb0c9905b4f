#include "tiler/roads/bridge_builder.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/random.h"
#include "tiler/roofs/self_intersection.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Finish;
using world::kHeightStep_m;
using world::Material;

/// A deck goes on into the ground at its ends.
constexpr double kInto_m = 0.3;
/// A support is shorter than this: none is needed.
constexpr double kLeastSupport_m = 1.5;
constexpr double kFoot_m = 1.2;
constexpr double kFootInWater_m = 5.0;
constexpr double kMarkAbove_m = 0.006;
constexpr double kHalfSleeper_m = 1.3;

/// Rows of Shape::finishes.
enum DeckFinish : std::uint8_t { kTop, kConcrete, kMark, kRail, kSleeper };

std::vector<Finish> finishes_of(const Deck& deck) {
  const SemanticClass what = deck.style.semantic_class == SemanticClass::Pier
                                 ? SemanticClass::Pier
                                 : SemanticClass::Bridge;
  const bool is_rail = deck.style.use == WayUse::Railway;
  const bool is_wood = what == SemanticClass::Pier && deck.style.half_width_m < 2.5;
  Finish top{.material = Material::Asphalt, .semantic_class = what, .color_srgb = {84, 84, 86}};
  if (is_rail)
    top = {.material = Material::Plain, .semantic_class = what, .color_srgb = {112, 104, 96}};
  if (deck.style.use == WayUse::Path)
    top = {.material = Material::Concrete, .semantic_class = what, .color_srgb = {168, 164, 156}};
  Finish body{
      .material = Material::Concrete, .semantic_class = what, .color_srgb = {158, 154, 146}};
  if (is_wood) {
    top = {.material = Material::Planks, .semantic_class = what, .color_srgb = {140, 118, 92}};
    body = {.material = Material::Planks, .semantic_class = what, .color_srgb = {104, 88, 70}};
  }
  return {top,
          body,
          {.material = Material::Plain,
           .semantic_class = SemanticClass::RoadMarking,
           .color_srgb = {222, 221, 216}},
          {.material = Material::Metal, .semantic_class = what, .color_srgb = {120, 112, 106}},
          {.material = Material::Concrete, .semantic_class = what, .color_srgb = {140, 136, 128}}};
}

/// Across a line: to the left, and up from the profile.
using Profile = std::vector<Vector2d>;

class Mesh {
 public:
  Mesh(const geo::WorldFrame& frame, const Deck& deck) : frame_(frame) {
    const DeckPoint& first = deck.points.front();
    origin_m_ = {std::round(first.at_world.x()), std::round(first.at_world.y()),
                 std::round(z_of(first.at_world, first.level_m))};
    shape_.finishes = finishes_of(deck);
  }

  Eigen::Vector3i origin_steps() const {
    return (origin_m_ / kHeightStep_m).array().round().cast<int>();
  }
  world::Shape take() { return std::move(shape_); }
  /// Whether a body that was swept meets itself, as inside of a bend that is sharper than it is wide.
  bool meets_itself() const { return meets_itself_; }

  /// Sweeps a profile along points; `caps` cuts it into triangles; finishes by the profile's sides.
  void sweep(const std::vector<DeckPoint>& points, const Profile& profile,
             const std::vector<std::array<std::uint32_t, 3>>& caps,
             const std::vector<std::uint8_t>& finishes, std::uint8_t cap_finish) {
    begin_body();
    const auto num = static_cast<std::uint32_t>(profile.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const DeckPoint& point = points[i];
      Vector2d direction = point.tangent;
      double miter = 1.0;
      if (i > 0) {
        const Vector2d before = (point.at_world - points[i - 1].at_world).normalized();
        miter = 1.0 / std::max(before.dot(point.tangent), 0.7);
      }
      if (i + 1 == points.size() || i == 0) miter = 1.0;
      const Vector2d left(-direction.y(), direction.x());
      for (const Vector2d& corner : profile)
        put(place(point.at_world, left * (corner.x() * miter), point.level_m, corner.y()));
    }
    for (std::uint32_t i = 0; i + 1 < points.size(); ++i)
      for (std::uint32_t k = 0; k < num; ++k) {
        const std::uint32_t a = i * num + k;
        const std::uint32_t b = i * num + (k + 1) % num;
        triangle(a, b, a + num, finishes[k]);
        triangle(b, b + num, a + num, finishes[k]);
      }
    const auto end = static_cast<std::uint32_t>((points.size() - 1) * num);
    for (const auto& cap : caps) {
      triangle(cap[0], cap[2], cap[1], cap_finish);
      triangle(end + cap[0], end + cap[1], end + cap[2], cap_finish);
    }
    end_body();
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::size_t t = first_triangle_; t < shape_.triangles.size(); ++t)
      triangles.push_back(shape_.triangles[t].corners);
    meets_itself_ = meets_itself_ || tiler::meets_itself(shape_.vertices_steps, triangles);
  }

  /// A rectangle of a profile.
  void bar(const std::vector<DeckPoint>& points, double left_m, double right_m, double low_m,
           double high_m, std::uint8_t finish) {
    sweep(points, {{left_m, low_m}, {left_m, high_m}, {right_m, high_m}, {right_m, low_m}},
          {{0, 1, 2}, {0, 2, 3}}, {finish, finish, finish, finish}, finish);
  }

  /// An upright box about a place.
  void post(const Vector2d& at, const Vector2d& tangent, double half_along_m, double half_across_m,
            double low_level_m, double high_level_m, std::uint8_t finish) {
    begin_body();
    const Vector2d left(-tangent.y(), tangent.x());
    for (const double level_m : {low_level_m, high_level_m})
      for (const auto& [along, across] :
           {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
        const Vector2d aside = along * half_along_m * tangent + across * half_across_m * left;
        put(place(at, aside, high_level_m, level_m - high_level_m));
      }
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t next = (k + 1) % 4;
      triangle(k, next, k + 4, finish);
      triangle(next, next + 4, k + 4, finish);
    }
    triangle(0, 2, 1, finish);
    triangle(0, 3, 2, finish);
    triangle(4, 5, 6, finish);
    triangle(4, 6, 7, finish);
    end_body();
  }

 private:
  /// World place of a point beside a line, raised along up.
  Vector3d place(const Vector2d& at, const Vector2d& aside, double level_m, double up_m) const {
    const Vector2d there = at + aside;
    // Level across: the ground's curve over some metres is nothing, its lean is not.
    const double z = z_of(there, level_m);
    const Vector3d foot(there.x(), there.y(), z);
    return foot + up_m * frame_.up_world(foot);
  }
  void put(const Vector3d& place_world) {
    const Vector3d own_steps = (place_world - origin_m_) / kHeightStep_m;
    shape_.vertices_steps.emplace_back(static_cast<int>(std::lround(own_steps.x())),
                                       static_cast<int>(std::lround(own_steps.y())),
                                       static_cast<int>(std::lround(own_steps.z())));
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint8_t finish) {
    shape_.triangles.push_back({.corners = {first_ + a, first_ + b, first_ + c}, .finish = finish});
  }
  void begin_body() {
    first_ = static_cast<std::uint32_t>(shape_.vertices_steps.size());
    first_triangle_ = shape_.triangles.size();
  }
  /// Turned outward: the volume within is above 0.
  void end_body() {
    double volume = 0.0;
    const Vector3d about = shape_.vertices_steps[first_].cast<double>();
    for (std::size_t t = first_triangle_; t < shape_.triangles.size(); ++t) {
      const auto& corners = shape_.triangles[t].corners;
      const Vector3d a = shape_.vertices_steps[corners[0]].cast<double>() - about;
      const Vector3d b = shape_.vertices_steps[corners[1]].cast<double>() - about;
      const Vector3d c = shape_.vertices_steps[corners[2]].cast<double>() - about;
      volume += a.dot(b.cross(c));
    }
    if (volume >= 0.0) return;
    for (std::size_t t = first_triangle_; t < shape_.triangles.size(); ++t)
      std::swap(shape_.triangles[t].corners[1], shape_.triangles[t].corners[2]);
  }

  const geo::WorldFrame& frame_;
  Vector3d origin_m_;
  world::Shape shape_;
  std::uint32_t first_ = 0;
  std::size_t first_triangle_ = 0;
  bool meets_itself_ = false;
};

DeckPoint point_at(const Deck& deck, double along_m) {
  const auto& points = deck.points;
  const auto end = std::lower_bound(
      points.begin() + 1, points.end() - 1, along_m,
      [](const DeckPoint& point, double place_m) { return point.along_m < place_m; });
  const DeckPoint& a = *(end - 1);
  const DeckPoint& b = *end;
  const double t = (along_m - a.along_m) / (b.along_m - a.along_m);
  DeckPoint at;
  at.at_world = a.at_world + t * (b.at_world - a.at_world);
  at.tangent = (b.at_world - a.at_world).normalized();
  at.along_m = along_m;
  at.level_m = a.level_m + t * (b.level_m - a.level_m);
  return at;
}

/// The points from one place to another.
std::vector<DeckPoint> part(const Deck& deck, double from_m, double to_m) {
  std::vector<DeckPoint> points = {point_at(deck, from_m)};
  for (const DeckPoint& point : deck.points)
    if (point.along_m > from_m + 0.2 && point.along_m < to_m - 0.2) points.push_back(point);
  points.push_back(point_at(deck, to_m));
  return points;
}

/// Fewer points: those so far apart, and the last.
std::vector<DeckPoint> thinned(const std::vector<DeckPoint>& points, double least_m) {
  std::vector<DeckPoint> kept = {points.front()};
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    if (points[i].along_m - kept.back().along_m >= least_m &&
        points.back().along_m - points[i].along_m >= least_m)
      kept.push_back(points[i]);
  kept.push_back(points.back());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Vector2d before =
        i > 0 ? Vector2d((kept[i].at_world - kept[i - 1].at_world).normalized()) : Vector2d::Zero();
    const Vector2d after = i + 1 < kept.size()
                               ? Vector2d((kept[i + 1].at_world - kept[i].at_world).normalized())
                               : Vector2d::Zero();
    const Vector2d sum = before + after;
    kept[i].tangent = sum.norm() > 0.1 ? Vector2d(sum.normalized()) : after;
  }
  return kept;
}

void add_body(const Deck& deck, const std::vector<DeckPoint>& points, bool is_fine, Mesh& mesh) {
  const double half_m = deck.style.half_width_m + (deck.parapet_m > 0.0 ? 0.6 : 0.0);
  const double top_m = kDeckAbove_m;
  const double low_m = top_m - deck.thickness_m;
  const double chamfer_m = std::min(0.9, 0.3 * half_m);
  const double edge_m = top_m - std::min(0.45, 0.5 * deck.thickness_m);
  if (!is_fine || deck.parapet_m <= 0.0) {
    mesh.sweep(points,
               {{half_m, edge_m},
                {half_m, top_m},
                {-half_m, top_m},
                {-half_m, edge_m},
                {-half_m + chamfer_m, low_m},
                {half_m - chamfer_m, low_m}},
               {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}},
               {kConcrete, kTop, kConcrete, kConcrete, kConcrete, kConcrete}, kConcrete);
    return;
  }
  const double wall_m = deck.style.use == WayUse::Path ? 0.12 : 0.25;
  const double high_m = top_m + deck.parapet_m;
  const double inner_m = half_m - wall_m;
  mesh.sweep(
      points,
      {{half_m, edge_m},
       {half_m, high_m},
       {inner_m, high_m},
       {inner_m, top_m},
       {-inner_m, top_m},
       {-inner_m, high_m},
       {-half_m, high_m},
       {-half_m, edge_m},
       {-half_m + chamfer_m, low_m},
       {half_m - chamfer_m, low_m}},
      {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {0, 3, 4}, {0, 4, 7}, {0, 7, 8}, {0, 8, 9}},
      {kConcrete, kConcrete, kConcrete, kTop, kConcrete, kConcrete, kConcrete, kConcrete, kConcrete,
       kConcrete},
      kConcrete);
}

/// What of a line beside a deck's middle the deck bears, for no other lies there: from and to along
/// it.
std::vector<std::pair<double, double>> own_lines(const Deck& deck, const DeckSite& site,
                                                 double across_m, double from_m, double to_m) {
  constexpr double kStep_m = 0.5;
  if (!site.is_without_marks) return {{from_m, to_m}};
  std::vector<std::pair<double, double>> own;
  const int num = std::max(1, static_cast<int>(std::ceil((to_m - from_m) / kStep_m)));
  bool was_own = false;
  for (int k = 0; k <= num; ++k) {
    const double at_m = from_m + (to_m - from_m) * k / num;
    const DeckPoint at = point_at(deck, at_m);
    const Vector2d left(-at.tangent.y(), at.tangent.x());
    const bool is_own = !site.is_without_marks(at.at_world + across_m * left, at.level_m);
    if (is_own && was_own)
      own.back().second = at_m;
    else if (is_own)
      own.emplace_back(at_m, at_m);
    was_own = is_own;
  }
  std::erase_if(own, [](const auto& piece) { return piece.second - piece.first < kStep_m; });
  return own;
}

/// Whether a sleeper would lie on another deck where this one bears no marks, parapets and all,
/// which are wider than its paving.
bool is_on_other_deck(const DeckSite& site, const Vector2d& place, const Vector2d& tangent,
                      double level_m) {
  if (!site.is_without_marks) return false;
  constexpr double kBeside_m = 0.5;
  const Vector2d along = kBeside_m * tangent;
  const Vector2d aside = (kHalfSleeper_m + kBeside_m) * Vector2d(-tangent.y(), tangent.x());
  for (const double a : {-1.0, 0.0, 1.0})
    for (const double b : {-1.0, 0.0, 1.0})
      if (site.is_without_marks(place + a * along + b * aside, level_m)) return true;
  return false;
}

void add_marks(const Deck& deck, const DeckSite& site, Mesh& mesh) {
  const double from_m = deck.points.front().along_m;
  const double to_m = deck.points.back().along_m;
  const double low_m = kDeckAbove_m - 0.03;
  const double high_m = kDeckAbove_m + kMarkAbove_m;
  const WayStyle& style = deck.style;
  if (style.use == WayUse::Railway) {
    for (int track = 0; track < style.num_lanes; ++track) {
      const double middle_m = style.half_width_m * (1.0 - (2.0 * track + 1.0) / style.num_lanes);
      for (const double side : {-0.7535, 0.7535})  // 1435 mm between heads of 72 mm
        mesh.bar(deck.points, middle_m + side + 0.036, middle_m + side - 0.036, low_m,
                 kDeckAbove_m + 0.18, kRail);
      if (to_m - from_m > 500.0) continue;
      for (double at_m = from_m + 0.3; at_m < to_m - 0.3; at_m += 0.6) {
        const DeckPoint at = point_at(deck, at_m);
        const Vector2d left(-at.tangent.y(), at.tangent.x());
        const Vector2d place = at.at_world + middle_m * left;
        // On another deck, as of a road that crosses at its level, rails lie without sleepers.
        if (is_on_other_deck(site, place, at.tangent, at.level_m)) continue;
        mesh.post(place, at.tangent, 0.13, kHalfSleeper_m, at.level_m - 0.05, at.level_m + 0.07,
                  kSleeper);
      }
    }
    return;
  }
  const bool has_edges =
      style.marking == world::Marking::Lanes || style.marking == world::Marking::Motorway;
  if (!has_edges && style.marking != world::Marking::Center) return;
  constexpr double kHalfLine_m = 0.06;
  const auto line = [&](double across_m, double a_m, double b_m) {
    for (const auto& [first_m, last_m] : own_lines(deck, site, across_m, a_m, b_m))
      mesh.bar(part(deck, first_m, last_m), across_m + kHalfLine_m, across_m - kHalfLine_m, low_m,
               high_m, kMark);
  };
  const double edge_m = style.half_width_m - 0.31;
  if (has_edges)
    for (const double side : {-edge_m, edge_m}) line(side, from_m + 0.5, to_m - 0.5);
  const double width_m = has_edges ? edge_m : style.half_width_m;
  for (int lane = 1; lane < std::max(style.num_lanes, has_edges ? 1 : 2); ++lane) {
    const double across_m = width_m - 2.0 * width_m * lane / std::max(style.num_lanes, 2);
    for (double at_m = from_m + 4.0; at_m + 4.5 < to_m; at_m += 12.0)
      line(across_m, at_m, at_m + 4.0);
  }
}

void add_supports(const Deck& deck, const DeckSite& site, Mesh& mesh) {
  const double from_m = deck.points.front().along_m;
  const double to_m = deck.points.back().along_m;
  const double under_m = kDeckAbove_m - deck.thickness_m + 0.12;  // within the deck
  const double half_m = deck.style.half_width_m + (deck.parapet_m > 0.0 ? 0.6 : 0.0);
  const auto foot_level_m = [&](const Vector2d& at, double half_along_m, double half_across_m,
                                const Vector2d& tangent) {
    const Vector2d left(-tangent.y(), tangent.x());
    double lowest_m = site.ground_level_m(at);
    for (const double along : {-half_along_m, half_along_m})
      for (const double across : {-half_across_m, half_across_m})
        lowest_m = std::min(lowest_m, site.ground_level_m(at + along * tangent + across * left));
    return lowest_m - (site.is_water(at) ? kFootInWater_m : kFoot_m) - deck.feet_lowered_m;
  };
  if (deck.has_abutments && to_m - from_m > 4.0)
    for (const bool is_start : {true, false}) {
      const double at_m = is_start ? from_m + 0.9 : to_m - 0.9;
      const DeckPoint at = point_at(deck, at_m);
      const double half_across_m = half_m - 0.05;
      const double low_m = foot_level_m(at.at_world, 0.85, half_across_m, at.tangent);
      const double grade_m = 0.25;  // the deck's fall over the abutment
      const double high_m = at.level_m + under_m - grade_m;
      if (high_m - low_m > 0.3)
        mesh.post(at.at_world, at.tangent, 0.85, half_across_m, low_m, high_m + 0.2, kConcrete);
    }
  const double length_m = to_m - from_m;
  const int num_spans = std::max(1, static_cast<int>(std::ceil(length_m / deck.span_m)));
  const bool is_light = deck.style.use == WayUse::Path;
  const double half_along_m = is_light ? 0.2 : 0.6;
  for (int k = deck.has_abutments ? 1 : 0; k < num_spans + (deck.has_abutments ? 0 : 1); ++k) {
    const double wanted_m = from_m + std::clamp(length_m * k / num_spans, 0.6, length_m - 0.6);
    // Where the way below leaves room.
    for (const double aside_m : {0.0, 3.0, -3.0, 6.0, -6.0, 9.0, -9.0, 12.0, -12.0}) {
      const double at_m = wanted_m + aside_m;
      if (at_m < from_m + 0.5 || at_m > to_m - 0.5) continue;
      const DeckPoint at = point_at(deck, at_m);
      const Vector2d left(-at.tangent.y(), at.tangent.x());
      if (at.level_m + under_m - site.ground_level_m(at.at_world) < kLeastSupport_m &&
          !site.is_water(at.at_world))
        break;
      if (site.is_taken(at.at_world, 0.4 * half_m + 0.8)) continue;
      std::vector<double> columns = {0.0};
      double half_across_m = is_light ? 0.2 : std::max(0.6, 0.45 * half_m);
      if (half_m > 5.0 || (is_light && half_m > 0.9)) {
        columns = {-0.5 * half_m, 0.5 * half_m};
        half_across_m = is_light ? 0.15 : 0.7;
      }
      for (const double across_m : columns) {
        const Vector2d place = at.at_world + across_m * left;
        const double low_m = foot_level_m(place, half_along_m, half_across_m, at.tangent);
        mesh.post(place, at.tangent, half_along_m, half_across_m, low_m, at.level_m + under_m,
                  kConcrete);
      }
      break;
    }
  }
}

}  // namespace

std::vector<Deck> bridge_decks(const RoadNetwork& network, const RoadHeights& heights) {
  std::vector<Deck> decks;
  std::set<std::uint64_t> keys;
  for (const Line& line : network.lines()) {
    for (std::size_t s = 0; s < line.spans.size();) {
      if (!network.style(line.spans[s]).is_bridge) {
        ++s;
        continue;
      }
      std::size_t last = s;
      while (last + 1 < line.spans.size() && network.style(line.spans[last + 1]).is_bridge) ++last;
      Deck deck;
      double longest_m = -1.0;
      for (std::size_t k = s; k <= last; ++k) {
        const Span& span = line.spans[k];
        const double own_m =
            line.points[span.last_point].along_m - line.points[span.first_point].along_m;
        if (own_m <= longest_m) continue;
        longest_m = own_m;
        deck.feature = network.ways()[span.way].feature;
        deck.style = network.style(span);
      }
      deck.thickness_m = RoadHeights::deck_m(deck.style);
      if (deck.style.use == WayUse::Path) {
        deck.parapet_m = 1.1;
        deck.span_m = 18.0;
      } else if (deck.style.use == WayUse::Railway) {
        deck.parapet_m = 0.5;
      }
      for (std::uint32_t p = line.spans[s].first_point; p <= line.spans[last].last_point; ++p) {
        const Line::Point& point = line.points[p];
        if (!deck.points.empty() && point.along_m - deck.points.back().along_m < 0.4) {
          if (p < line.spans[last].last_point || deck.points.size() < 2) continue;
          deck.points.pop_back();
        }
        deck.points.push_back(
            {point.at_world, point.tangent, point.along_m, heights.level_m(point)});
      }
      s = last + 1;
      if (deck.points.size() < 2 || deck.points.back().along_m - deck.points.front().along_m < 1.5)
        continue;
      std::uint64_t place = 0;
      for (const Vector2d& at : {deck.points.front().at_world, deck.points.back().at_world})
        place +=
            core::mix_bits(static_cast<std::uint64_t>(std::llround(at.x() * 10.0)) * 0x9e3779b9ULL +
                           static_cast<std::uint64_t>(std::llround(at.y() * 10.0)));
      deck.key = core::stream_of(deck.feature, place);
      while (!keys.insert(deck.key).second) ++deck.key;
      decks.push_back(std::move(deck));
    }
  }
  return decks;
}

world::Solid build_deck(const Deck& deck, const DeckSite& site) {
  world::Solid solid;
  solid.provenance.feature = deck.feature;
  if (deck.points.size() < 2) return solid;
  Deck longer = deck;
  if (deck.has_abutments) {
    DeckPoint& first = longer.points.front();
    DeckPoint& last = longer.points.back();
    first.at_world -= kInto_m * first.tangent;
    last.at_world += kInto_m * last.tangent;
    first.along_m -= kInto_m;
    last.along_m += kInto_m;
  }
  const DeckPoint middle =
      point_at(longer, 0.5 * (longer.points.front().along_m + longer.points.back().along_m));
  solid.place_m = middle.at_world.array().floor().cast<int>();
  // Its points, then fewer and fewer until no bend folds it; straight in the end.
  for (const bool is_fine : {true, false})
    for (double least_m = is_fine ? 0.0 : 24.0;; least_m = std::max(2.0, 2.0 * least_m)) {
      Deck simpler = longer;
      if (least_m > 0.0) simpler.points = thinned(longer.points, least_m);
      Mesh mesh(site.frame, longer);
      add_body(simpler, simpler.points, is_fine, mesh);
      add_supports(is_fine ? simpler : longer, site, mesh);
      if (is_fine) add_marks(simpler, site, mesh);
      if (mesh.meets_itself() && simpler.points.size() > 2) continue;
      solid.origin_steps = mesh.origin_steps();
      solid.levels.push_back(
          {.coarsest_level = static_cast<std::int8_t>(is_fine ? kFineDeckLevel : kCoarseDeckLevel),
           .shape = mesh.take()});
      break;
    }
  return solid;
}

}  // namespace terracast::tiler
