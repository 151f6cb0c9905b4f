#include "tiler/layer.h"

#include <cmath>

#include "core/plugin_rows.h"
#include "core/registry.h"

// Every kind of layer, in alphabetical order: X(name) is tiler/layers/name.cpp, which defines
// `LayerKindInfo name_layer()`.
#define TERRACAST_LAYER_KINDS(X) \
  X(buildings) X(clouds) X(imagery) X(land_cover) X(objects) X(roads) X(vegetation) X(water)

namespace terracast::tiler {

#define TERRACAST_DECLARE(name) LayerKindInfo name##_layer();
TERRACAST_LAYER_KINDS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const LayerKindInfo> layer_kinds() {
#define TERRACAST_ENTRY(name) name##_layer(),
  static const auto table =
      core::with_plugin_rows<LayerKindInfo>({TERRACAST_LAYER_KINDS(TERRACAST_ENTRY)});
#undef TERRACAST_ENTRY
  return table;
}

double shown_z_world(
    const std::function<double(const Eigen::Vector2d& place_world)>& ground_z_world,
    const Eigen::Vector2d& place_world, int level) {
  const double spacing_m = std::exp2(level);
  const Eigen::Vector2d at = place_world / spacing_m;
  const Eigen::Vector2d corner = at.array().floor();
  const Eigen::Vector2d share = at - corner;  // exact: a power of two divides
  const auto z_at = [&](double di, double dj) {
    return ground_z_world(spacing_m * (corner + Eigen::Vector2d(di, dj)));
  };
  // Cells are cut from (x + 1, y) to (x, y + 1).
  const double z10 = z_at(1, 0);
  const double z01 = z_at(0, 1);
  const double beyond = share.x() + share.y() - 1.0;
  if (beyond == 0.0) return share.x() * z10 + share.y() * z01;
  if (beyond < 0.0) {
    const double z00 = z_at(0, 0);
    return z00 + share.x() * (z10 - z00) + share.y() * (z01 - z00);
  }
  const double z11 = z_at(1, 1);
  return z11 + (1.0 - share.x()) * (z01 - z11) + (1.0 - share.y()) * (z10 - z11);
}

void LayerOptions::describe(core::SchemaVisitor& visit) {
  visit.key("name", name, "Name of the layer; left out: its kind's.");
  visit.key("kind", kind, "Kind of layer; it decides the keys below.",
            core::required(core::one_of(core::registry_names(layer_kinds()))));
  visit.key("seed", seed, "Seed of what the layer draws, beside the world's.");
  visit.key("licence", licence, "Terms under which the source may be used; kept with the data.");
  visit.key("accuracy", accuracy,
            "How good the source says that its places are, in its own words; kept with the data.");
  // A manual without a config shows the keys of the first kind.
  if (layer_kinds().empty()) return;
  kind_options_.describe(visit, layer_kinds(), "kind of layer",
                         kind.empty() ? std::string(layer_kinds().front().name) : kind);
}

void LayerOptions::validate() const { kind_options_.validate(); }

}  // namespace terracast::tiler
