#include "tiler/buildings/roof.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "tiler/buildings/footprint.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;

/// Points of a roof that are nearer to each other are one, steps.
constexpr double kMerge_steps = 80.0;
/// Gables lower than this are none: their triangles may turn over when their corners are rounded in the world.
constexpr double kLeastRise_steps = 4.0;
/// Skeletons of more corners take too long, and no house has them.
constexpr std::size_t kMostCorners = 120;

struct Corners {
  std::vector<Vector2d> at;
  std::vector<int> next;
  std::vector<int> previous;

  explicit Corners(const RingsSteps& rings) {
    for (const auto& ring : rings) {
      const int first = static_cast<int>(at.size());
      const int n = static_cast<int>(ring.size());
      for (int i = 0; i < n; ++i) {
        at.push_back(ring[static_cast<std::size_t>(i)].cast<double>());
        next.push_back(first + (i + 1) % n);
        previous.push_back(first + (i + n - 1) % n);
      }
    }
  }
  int size() const { return static_cast<int>(at.size()); }
  Vector2d corner(int i) const { return at[static_cast<std::size_t>(i)]; }
  int after(int i) const { return next[static_cast<std::size_t>(i)]; }
  int before(int i) const { return previous[static_cast<std::size_t>(i)]; }
  Vector2d direction(int edge) const { return (corner(after(edge)) - corner(edge)).normalized(); }
  double length(int edge) const { return (corner(after(edge)) - corner(edge)).norm(); }
  double distance(int edge, const Vector2d& place) const {
    const Vector2d along = direction(edge);
    const Vector2d to = place - corner(edge);
    return along.x() * to.y() - along.y() * to.x();
  }
};

/// A roof in the making: the skeleton's nodes with their distances from the edges.
struct Draft {
  std::vector<Vector2d> places;
  std::vector<double> distances;
  std::vector<std::vector<int>> faces;  ///< without those that became gables
  std::vector<std::vector<int>> gable_points;
};

/// The hip of a wing's end stands up to a gable: its node goes out to the edge, along the ridge.
bool raise_gable(const Corners& corners, int edge, double share, Draft& draft) {
  auto& face = draft.faces[static_cast<std::size_t>(edge)];
  if (face.size() != 3) return false;
  const int node = face[2];
  int num_faces = 0;
  for (const auto& other : draft.faces)
    num_faces += std::find(other.begin(), other.end(), node) != other.end() ? 1 : 0;
  if (num_faces != 3) return false;
  const int before = corners.before(edge);
  const int after = corners.after(edge);
  const Vector2d outward = corners.direction(before) - corners.direction(after);
  const Vector2d along = corners.direction(edge);
  const Vector2d from = draft.places[static_cast<std::size_t>(node)];
  const double closing = along.x() * outward.y() - along.y() * outward.x();
  if (outward.norm() < 0.5 || closing > -0.5) return false;
  const double t = -corners.distance(edge, from) / closing;
  const Vector2d place = from + share * t * outward;
  const double where = along.dot(place - corners.corner(edge)) / corners.length(edge);
  if (where < 0.2 || where > 0.8) return false;
  draft.places[static_cast<std::size_t>(node)] = place;
  draft.distances[static_cast<std::size_t>(node)] = corners.distance(before, place);
  if (share < 1.0) return true;
  draft.gable_points[static_cast<std::size_t>(edge)] = {node};
  face.clear();
  return true;
}

/// Splits all faces along the line at one distance from the edges.
bool cut_at(double distance, Draft& draft) {
  std::map<std::pair<int, int>, int> split;
  const auto crossing = [&](int a, int b) {
    const auto key = std::minmax(a, b);
    const auto found = split.find(key);
    if (found != split.end()) return found->second;
    const double da = draft.distances[static_cast<std::size_t>(key.first)];
    const double db = draft.distances[static_cast<std::size_t>(key.second)];
    const double t = (distance - da) / (db - da);
    const int index = static_cast<int>(draft.places.size());
    draft.places.push_back(draft.places[static_cast<std::size_t>(key.first)] * (1.0 - t) +
                           draft.places[static_cast<std::size_t>(key.second)] * t);
    draft.distances.push_back(distance);
    split.emplace(key, index);
    return index;
  };
  const auto below = [&](int node) {
    return draft.distances[static_cast<std::size_t>(node)] < distance;
  };
  std::vector<std::vector<int>> faces;
  for (const auto& face : draft.faces) {
    if (face.empty()) continue;
    std::vector<int> low;
    std::vector<int> high;
    int num_crossings = 0;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const int a = face[i];
      const int b = face[(i + 1) % face.size()];
      (below(a) ? low : high).push_back(a);
      if (below(a) == below(b)) continue;
      const int node = crossing(a, b);
      low.push_back(node);
      high.push_back(node);
      ++num_crossings;
    }
    if (num_crossings > 2) return false;
    if (low.size() >= 3) faces.push_back(low);
    if (high.size() >= 3) faces.push_back(high);
  }
  // Gables get the points too; their edges are those of faces.
  for (std::size_t edge = 0; edge < draft.gable_points.size(); ++edge) {
    auto& points = draft.gable_points[edge];
    if (points.empty()) continue;
    std::vector<int> chain;
    int before = static_cast<int>(edge);
    std::vector<int> all = points;
    all.push_back(-1 - static_cast<int>(edge));
    for (const int raw : all) {
      // The edge's second corner has its number in the gable's last split, whatever its ring.
      int at = raw;
      if (raw < 0) {
        at = -1;
        for (const auto& [key, node] : split) {
          const int corner = key.first == before ? key.second : key.first;
          if ((key.first == before || key.second == before) && corner != static_cast<int>(edge) &&
              draft.distances[static_cast<std::size_t>(corner)] == 0.0) {
            chain.push_back(node);
            break;
          }
        }
        break;
      }
      const auto found = split.find(std::minmax(before, at));
      if (found != split.end()) chain.push_back(found->second);
      chain.push_back(at);
      before = at;
    }
    points = chain;
  }
  draft.faces = std::move(faces);
  return true;
}

struct Profile {
  /// Distances from the edges, as shares of the farthest, and rises there, as shares of the
  /// highest.
  std::vector<std::pair<double, double>> points;

  double at(double distance) const {
    for (std::size_t i = 1; i < points.size(); ++i)
      if (distance <= points[i].first || i + 1 == points.size()) {
        const auto& [d0, r0] = points[i - 1];
        const auto& [d1, r1] = points[i];
        return r0 + (r1 - r0) * (distance - d0) / (d1 - d0);
      }
    return 0.0;
  }
};

Profile profile_of(RoofShape shape) {
  switch (shape) {
    case RoofShape::Gambrel:
      return {{{0.0, 0.0}, {0.45, 0.68}, {1.0, 1.0}}};
    case RoofShape::Mansard:
      return {{{0.0, 0.0}, {0.22, 0.72}, {1.0, 1.0}}};
    case RoofShape::Round:
      return {{{0.0, 0.0}, {0.13, 0.5}, {0.35, 0.76}, {0.65, 0.94}, {1.0, 1.0}}};
    default:
      return {{{0.0, 0.0}, {1.0, 1.0}}};
  }
}

/// Rounds, merges what is too near, and takes the edges from the faces.
std::optional<Roof> finish(const RingsSteps& rings, const Draft& draft,
                           const std::vector<double>& rises) {
  Roof roof;
  std::vector<int> index_of(draft.places.size(), -1);
  std::size_t num_corners_all = 0;
  for (const auto& ring : rings)
    for (const Vector2i& corner : ring) {
      index_of[num_corners_all] = static_cast<int>(num_corners_all);
      ++num_corners_all;
      roof.points_steps.push_back(corner);
    }
  roof.rises_steps.assign(rises.begin(),
                          rises.begin() + static_cast<std::ptrdiff_t>(num_corners_all));
  std::set<int> used;
  for (const auto& face : draft.faces) used.insert(face.begin(), face.end());
  for (const int node : used) {
    const auto i = static_cast<std::size_t>(node);
    if (i < num_corners_all) continue;
    for (std::size_t k = 0; k < roof.points_steps.size(); ++k)
      if ((roof.points_steps[k].cast<double>() - draft.places[i]).norm() < kMerge_steps) {
        if (k < num_corners_all) return std::nullopt;
        index_of[i] = static_cast<int>(k);
        break;
      }
    if (index_of[i] >= 0) continue;
    index_of[i] = static_cast<int>(roof.points_steps.size());
    roof.points_steps.push_back(draft.places[i].array().round().cast<int>());
    roof.rises_steps.push_back(rises[i]);
  }
  std::set<std::pair<int, int>> border;
  const Corners corners(rings);
  for (int edge = 0; edge < corners.size(); ++edge) {
    roof.gable_points.emplace_back();
    int before = edge;
    for (const int node : draft.gable_points[static_cast<std::size_t>(edge)]) {
      const int at = index_of[static_cast<std::size_t>(node)];
      if (at < 0 || at == before) return std::nullopt;
      border.insert(std::minmax(before, at));
      roof.gable_points.back().push_back(at);
      before = at;
    }
    border.insert(std::minmax(before, corners.after(edge)));
  }
  std::set<std::pair<int, int>> edges;
  for (const auto& nodes : draft.faces) {
    std::vector<int> face;
    for (const int node : nodes) {
      const int at = index_of[static_cast<std::size_t>(node)];
      if (face.empty() || face.back() != at) face.push_back(at);
    }
    while (face.size() > 1 && face.front() == face.back()) face.pop_back();
    if (face.size() < 3) continue;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const auto edge = std::minmax(face[i], face[(i + 1) % face.size()]);
      if (!border.contains(edge)) edges.insert(edge);
    }
    roof.faces.push_back(std::move(face));
  }
  for (const auto& [a, b] : edges) roof.edges.push_back({a, b});
  return roof;
}

Roof flat_roof(const RingsSteps& rings) {
  Roof roof;
  for (const auto& ring : rings)
    roof.points_steps.insert(roof.points_steps.end(), ring.begin(), ring.end());
  roof.rises_steps.assign(roof.points_steps.size(), 0.0);
  roof.gable_points.resize(roof.points_steps.size());
  return roof;
}

/// Rings about the middle that rise and narrow: pyramids, domes, spires.
std::optional<Roof> tent_roof(const RingsSteps& rings, const RoofOptions& options) {
  if (rings.size() != 1 || rings.front().size() > 40) return std::nullopt;
  const Corners corners(rings);
  const int n = corners.size();
  Vector2d middle = Vector2d::Zero();
  double weight = 0.0;
  for (int i = 0; i < n; ++i) {
    const Vector2d a = corners.corner(i);
    const Vector2d b = corners.corner(corners.after(i));
    const double cross = a.x() * b.y() - a.y() * b.x();
    middle += (a + b) * cross / 3.0;
    weight += cross;
  }
  middle /= weight;
  double nearest = 1e18;
  for (int i = 0; i < n; ++i) nearest = std::min(nearest, corners.distance(i, middle));
  // All edges are seen from the middle.
  if (nearest < 512.0) return std::nullopt;
  // Shares of the way to the middle, and of the height.
  std::vector<std::pair<double, double>> stages;
  if (options.shape == RoofShape::Dome)
    stages = {{0.07, 0.37}, {0.24, 0.65}, {0.5, 0.866}, {0.78, 0.975}};
  const double height =
      std::min(options.most_steps,
               options.height_steps > 0.0 ? options.height_steps : options.slope * nearest);
  Draft draft;
  draft.places = corners.at;
  std::vector<double> rises(corners.at.size(), 0.0);
  draft.gable_points.resize(corners.at.size());
  int below = 0;
  for (const auto& [inward, rise] : stages) {
    const int first = static_cast<int>(draft.places.size());
    for (int i = 0; i < n; ++i) {
      draft.places.push_back(corners.corner(i) + inward * (middle - corners.corner(i)));
      rises.push_back(rise * height);
    }
    for (int i = 0; i < n; ++i) {
      const int j = corners.after(i);
      draft.faces.push_back({below + i, below + j, first + j, first + i});
    }
    below = first;
  }
  const int top = static_cast<int>(draft.places.size());
  draft.places.push_back(middle);
  rises.push_back(height);
  for (int i = 0; i < n; ++i) draft.faces.push_back({below + i, below + corners.after(i), top});
  return finish(rings, draft, rises);
}

std::optional<Roof> skillion_roof(const RingsSteps& rings, const RoofOptions& options) {
  Roof roof = flat_roof(rings);
  const Vector2d up_slope = -options.fall.normalized();
  double low = 1e18;
  double high = -1e18;
  for (const Vector2i& point : roof.points_steps) {
    low = std::min(low, up_slope.dot(point.cast<double>()));
    high = std::max(high, up_slope.dot(point.cast<double>()));
  }
  if (high - low < 512.0) return std::nullopt;
  const double height =
      std::min(options.most_steps,
               options.height_steps > 0.0 ? options.height_steps : options.slope * (high - low));
  std::vector<int> face;
  for (std::size_t i = 0; i < roof.points_steps.size(); ++i) {
    const double rise =
        height * (up_slope.dot(roof.points_steps[i].cast<double>()) - low) / (high - low);
    // Whole steps, and none that walls could not show: the sine of 180 degrees is not 0 in double.
    roof.rises_steps[i] = rise < kLeastRise_steps ? 0.0 : std::round(rise);
  }
  for (std::size_t i = 0; i < rings.front().size(); ++i) face.push_back(static_cast<int>(i));
  roof.faces.push_back(std::move(face));
  return roof;
}

bool is_quad(const RingsSteps& rings) {
  if (rings.size() != 1 || rings.front().size() != 4) return false;
  const Corners corners(rings);
  for (int i = 0; i < 4; ++i) {
    const Vector2d a = corners.direction(i);
    const Vector2d b = corners.direction((i + 1) % 4);
    if (a.x() * b.y() - a.y() * b.x() < 0.5) return false;
  }
  return true;
}

/// A ridge between the middles of two opposite edges.
Draft quad_draft(const RingsSteps& rings, int gable) {
  const Corners corners(rings);
  Draft draft;
  draft.places = corners.at;
  draft.distances.assign(4, 0.0);
  draft.gable_points.resize(4);
  const int a = gable;
  const int b = (gable + 1) % 4;
  const int c = (gable + 2) % 4;
  const int d = (gable + 3) % 4;
  draft.places.push_back(0.5 * (corners.corner(a) + corners.corner(b)));
  draft.places.push_back(0.5 * (corners.corner(c) + corners.corner(d)));
  const double half = 0.25 * (corners.length(a) + corners.length(c));
  draft.distances.insert(draft.distances.end(), {half, half});
  draft.faces = {{b, c, 5, 4}, {d, a, 4, 5}};
  draft.gable_points[static_cast<std::size_t>(a)] = {4};
  draft.gable_points[static_cast<std::size_t>(c)] = {5};
  return draft;
}

std::optional<Draft> skeleton_draft(const RingsSteps& rings) {
  if (num_corners(rings) > kMostCorners) return std::nullopt;
  std::optional<StraightSkeleton> skeleton = straight_skeleton(rings);
  if (!skeleton) return std::nullopt;
  Draft draft;
  for (const auto& node : skeleton->nodes) {
    draft.places.push_back(node.place_steps);
    draft.distances.push_back(node.distance_steps);
  }
  draft.faces = std::move(skeleton->faces);
  draft.gable_points.resize(num_corners(rings));
  return draft;
}

bool has_gables(RoofShape shape) {
  return shape == RoofShape::Gabled || shape == RoofShape::Gambrel || shape == RoofShape::Round ||
         shape == RoofShape::HalfHipped;
}

}  // namespace

double Roof::highest_steps() const {
  double highest = 0.0;
  for (const double rise : rises_steps) highest = std::max(highest, rise);
  return highest;
}

std::vector<bool> gable_edges(const RingsSteps& rings, const std::vector<bool>& attached,
                              bool ridge_across) {
  const Corners corners(rings);
  std::vector<bool> gables(corners.at.size(), false);
  if (is_quad(rings)) {
    const double even = corners.length(0) + corners.length(2);
    const double odd = corners.length(1) + corners.length(3);
    std::size_t first = (even <= odd) != ridge_across ? 0 : 1;
    if (attached.size() == 4 && !ridge_across) {
      const int even_attached = attached[0] + attached[2];
      const int odd_attached = attached[1] + attached[3];
      // Not so that the ridge runs along the short side of what is long.
      if (even_attached != odd_attached && std::max(even, odd) < 2.5 * std::min(even, odd))
        first = even_attached > odd_attached ? 0 : 1;
    }
    gables[first] = true;
    gables[first + 2] = true;
    return gables;
  }
  const std::optional<Draft> draft = skeleton_draft(rings);
  if (!draft) return gables;
  Draft trial = *draft;
  std::vector<int> ends;
  for (int edge = 0; edge < corners.size(); ++edge)
    if (trial.faces[static_cast<std::size_t>(edge)].size() == 3) ends.push_back(edge);
  std::stable_sort(ends.begin(), ends.end(),
                   [&](int a, int b) { return corners.length(a) < corners.length(b); });
  for (const int edge : ends)
    gables[static_cast<std::size_t>(edge)] = raise_gable(corners, edge, 1.0, trial);
  return gables;
}

std::optional<Roof> make_roof(const RingsSteps& rings, const RoofOptions& options) {
  switch (options.shape) {
    case RoofShape::Flat:
      return flat_roof(rings);
    case RoofShape::Skillion:
      return skillion_roof(rings, options);
    case RoofShape::Pyramidal:
    case RoofShape::Dome:
    case RoofShape::Spire:
      return tent_roof(rings, options);
    default:
      break;
  }
  const Corners corners(rings);
  std::vector<bool> gables = options.gables;
  if (has_gables(options.shape) && gables.size() != corners.at.size())
    gables = gable_edges(rings, {}, options.ridge_across);
  std::optional<Draft> draft;
  if (has_gables(options.shape) && options.shape != RoofShape::HalfHipped && is_quad(rings)) {
    draft = quad_draft(rings, gables[0] ? 0 : 1);
  } else {
    draft = skeleton_draft(rings);
    if (!draft) return std::nullopt;
    if (has_gables(options.shape))
      for (int edge = 0; edge < corners.size(); ++edge)
        if (gables[static_cast<std::size_t>(edge)] &&
            !raise_gable(corners, edge, options.shape == RoofShape::HalfHipped ? 0.6 : 1.0, *draft))
          return std::nullopt;
  }
  double farthest = 0.0;
  for (const double distance : draft->distances) farthest = std::max(farthest, distance);
  if (!(farthest > 0.0)) return std::nullopt;
  const double height =
      std::min(options.most_steps,
               options.height_steps > 0.0 ? options.height_steps : options.slope * farthest);
  const Profile profile = profile_of(options.shape);
  for (std::size_t i = 1; i + 1 < profile.points.size(); ++i)
    if (!cut_at(profile.points[i].first * farthest, *draft)) return std::nullopt;
  std::vector<double> rises;
  for (const double distance : draft->distances)
    rises.push_back(height * profile.at(distance / farthest));
  return finish(rings, *draft, rises);
}

}  // namespace terracast::tiler
