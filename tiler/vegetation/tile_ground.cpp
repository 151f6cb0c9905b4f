#include "tiler/vegetation/tile_ground.h"

#include <algorithm>
#include <cmath>

#include "geo/geodesy.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

/// Ground's facts are taken at nodes so far apart and interpolated.
constexpr double kFactNode_m = 32.0;

/// Whether it is forest is asked for at nodes so far apart, to find its edges.
constexpr double kEdgeNode_m = 16.0;

/// Covers between which woods and meadows may stray.
bool has_soft_edges(Cover cover) {
  return cover == Cover::Forest || cover == Cover::Land || cover == Cover::Shrubs ||
         cover == Cover::Grass || cover == Cover::Bare;
}

/// Whether plants of a cover have no other water than rain: mapped forests and fields have theirs.
bool grows_by_rain(Cover cover) {
  return cover == Cover::Land || cover == Cover::Shrubs || cover == Cover::Grass ||
         cover == Cover::Bare;
}

}  // namespace

TileGround::TileGround(const VegetationPlan& plan, const world::TileId& id, const LayerSite& site)
    : plan_(plan), site_(site) {
  const PlanBox reached = box_of(id).grown(2.0 * clump_side_m(kNumClumpSizes - 1));
  const auto node = [](double at, double apart_m = kFactNode_m) {
    return static_cast<int>(std::floor(at / apart_m));
  };
  // Places beyond the world's square bear nothing.
  const double half_m = plan.half_size_m;
  const Vector2d lowest = reached.lowest.cwiseMax(-half_m).cwiseMin(half_m);
  const Vector2d highest = reached.highest.cwiseMax(-half_m).cwiseMin(half_m);
  first_node_x_ = node(lowest.x());
  first_node_y_ = node(lowest.y());
  facts_ =
      Grid<Facts>(node(highest.x()) - first_node_x_ + 2, node(highest.y()) - first_node_y_ + 2);
  first_edge_x_ = node(lowest.x(), kEdgeNode_m);
  first_edge_y_ = node(lowest.y(), kEdgeNode_m);
  wooded_ = Grid<std::int8_t>(node(highest.x(), kEdgeNode_m) - first_edge_x_ + 2,
                              node(highest.y(), kEdgeNode_m) - first_edge_y_ + 2, -1);
}

const TileGround::Facts& TileGround::facts(int i, int j) {
  Facts& facts = facts_(std::clamp(i, 0, facts_.width - 1), std::clamp(j, 0, facts_.height - 1));
  if (!std::isnan(facts.z_world)) return facts;
  const double half_m = plan_.half_size_m;
  const double x = std::clamp((first_node_x_ + i) * kFactNode_m, -half_m, half_m);
  const double y = std::clamp((first_node_y_ + j) * kFactNode_m, -half_m, half_m);
  const SurfaceSample sample = plan_.surface.sample(x, y);
  facts.z_world = sample.z_world;
  // The tangent plane leaves the ellipsoid with the square of the distance.
  facts.height_m = sample.z_world + (x * x + y * y) / (2.0 * geo::kWgs84SemiMajorAxis_m);
  facts.moisture = sample.moisture / 255.0;
  return facts;
}

Ground TileGround::ground(const Vector2d& place_world) {
  const double x = place_world.x() / kFactNode_m - first_node_x_;
  const double y = place_world.y() / kFactNode_m - first_node_y_;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const double tx = x - i;
  const double ty = y - j;
  const Facts& sw = facts(i, j);
  const Facts& se = facts(i + 1, j);
  const Facts& nw = facts(i, j + 1);
  const Facts& ne = facts(i + 1, j + 1);
  const auto between = [&](double Facts::*value) {
    const double south = sw.*value + tx * (se.*value - sw.*value);
    const double north = nw.*value + tx * (ne.*value - nw.*value);
    return south + ty * (north - south);
  };
  const double rise_east_m =
      (1.0 - ty) * (se.z_world - sw.z_world) + ty * (ne.z_world - nw.z_world);
  const double rise_north_m =
      (1.0 - tx) * (nw.z_world - sw.z_world) + tx * (ne.z_world - se.z_world);
  return {.cover = site_.cover(place_world),
          .height_m = between(&Facts::height_m),
          .slope = std::hypot(rise_east_m, rise_north_m) / kFactNode_m,
          .moisture = between(&Facts::moisture)};
}

Cover TileGround::strayed_cover(const Vector2d& place_world, Cover own) const {
  if (!has_soft_edges(own)) return own;
  const Cover beside = site_.cover(plan_.habitat.strayed(place_world));
  return has_soft_edges(beside) ? beside : own;
}

bool TileGround::is_wooded(int i, int j) {
  std::int8_t& known =
      wooded_(std::clamp(i, 0, wooded_.width - 1), std::clamp(j, 0, wooded_.height - 1));
  if (known >= 0) return known > 0;
  const double half_m = plan_.half_size_m;
  const Vector2d at = Vector2d((first_edge_x_ + i) * kEdgeNode_m, (first_edge_y_ + j) * kEdgeNode_m)
                          .cwiseMax(-half_m)
                          .cwiseMin(half_m);
  known = strayed_cover(at, site_.cover(at)) == Cover::Forest ? 1 : 0;
  return known > 0;
}

double TileGround::edge(const Vector2d& place_world) {
  const double x = place_world.x() / kEdgeNode_m - first_edge_x_;
  const double y = place_world.y() / kEdgeNode_m - first_edge_y_;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const auto wooded = [&](int di, int dj) { return is_wooded(i + di, j + dj) ? 1.0 : 0.0; };
  const double south = wooded(0, 0) + (x - i) * (wooded(1, 0) - wooded(0, 0));
  const double north = wooded(0, 1) + (x - i) * (wooded(1, 1) - wooded(0, 1));
  const double share = south + (y - j) * (north - south);
  return 1.0 - std::abs(2.0 * share - 1.0);
}

void TileGround::find_details(Ground& ground, const Vector2d& place_world) {
  const Cover cover = ground.cover;
  if (has_soft_edges(cover)) ground.edge = edge(place_world);
  if (cover != Cover::Grass && cover != Cover::Land && cover != Cover::Crops) return;
  ground.has_rows = true;
  ground.is_by_way = plan_.is_by_way(place_world);
  ground.is_by_water = plan_.is_by_water(place_world);
}

Ground TileGround::strayed_ground(const Vector2d& place_world) {
  Ground ground = this->ground(place_world);
  ground.is_kept_short = ground.cover == Cover::Grass && plan_.is_kept_short(place_world);
  if (!ground.is_kept_short) ground.cover = strayed_cover(place_world, ground.cover);
  return ground;
}

TileGround::Here TileGround::here(const Vector2d& place_world) {
  Ground ground = strayed_ground(place_world);
  find_details(ground, place_world);
  return here_on(ground, place_world);
}

TileGround::Here TileGround::broadly(const Vector2d& place_world) {
  return here_on(strayed_ground(place_world), place_world);
}

TileGround::Here TileGround::here_on(const Ground& ground, const Vector2d& place_world) const {
  Here here{.place_world = place_world, .ground = ground};
  here.growth = plan_.habitat.growth(ground, place_world);
  here.is_garden = ground.cover == Cover::Grass && plan_.is_garden(place_world);
  if (plan_.dryness && grows_by_rain(ground.cover))
    Habitat::thin_out(here.growth, plan_.dryness->growth(place_world));
  if (here.is_garden) Habitat::plant_garden(here.growth);
  if (plan_.canopy) here.canopy_m = plan_.canopy->height_m(place_world);
  if (here.canopy_m) {
    here.growth.trees = *here.canopy_m >= kLowestTree_m ? 1.0 : 0.0;
    if (here.growth.trees == 1.0) here.growth.bushes *= 0.3;
  }
  return here;
}

TreeKinds TileGround::tree_kinds(const Here& here) const {
  TreeKinds kinds = plan_.habitat.tree_kinds(here.ground, here.place_world);
  if (here.is_garden) Habitat::plant_garden(kinds);
  if (here.canopy_m) kinds.dead = 0.0;
  return kinds;
}

}  // namespace terracast::tiler
