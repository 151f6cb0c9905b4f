#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "core/ledger.h"
#include "core/log.h"
#include "geo/geodesy.h"
#include "tiler/even_noise.h"
#include "tiler/grid.h"
#include "tiler/world_options.h"
#include "world/tile.h"

namespace terracast::tiler {

/// How dry a world's land is, by its aridity index: precipitation over potential evapotranspiration, both of
/// a year. Below 0.03 land is hyper-arid, below 0.2 arid, below 0.5 semi-arid, above 0.65 humid (UNEP 1997).
///
/// threads   safe
class Dryness {
 public:
  /// log       warns of the part of the square that a raster says nothing of; null: no warning
  /// returns   null where the world states no aridity: its land is taken as humid
  /// throws    Io, Input: a raster that cannot be read, says nothing of the square, holds no indices, or has
  ///           more samples in the square than fit into memory
  static std::shared_ptr<const Dryness> of(const WorldOptions& options,
                                           const geo::WorldFrame& frame,
                                           const core::Log* log = nullptr);

  double aridity_index(const Eigen::Vector2d& place_world) const;

  /// What covers dry land of which no layer knows more: bare ground in deserts, shrubs in steppes, more of
  /// both on ridges than in valleys; nothing where other things grow.
  /// moisture   of the place in its landscape, 0 … 1
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world, double moisture) const;

  /// How much grows, of what would grow in a humid climate: 0 … 1.
  double growth(const Eigen::Vector2d& place_world) const;

  const std::string& content_hash() const { return content_hash_; }
  /// What the raster's file says beside its samples; empty without one.
  const core::Ledger& ledger() const { return ledger_; }

 private:
  Dryness(const WorldOptions& options, const geo::WorldFrame& frame, const core::Log* log);
  void read(const WorldOptions& options, const geo::WorldFrame& frame, const core::Log* log);

  double half_size_m_;
  EvenNoise patches_;
  double index_ = 0.0;  ///< of all places, where no raster says more
  Grid<double> nodes_;  ///< of the raster, over the square; empty without one
  double node_spacing_m_ = 0.0;
  std::string content_hash_;
  core::Ledger ledger_;
};

/// The log's line on how dry the land is, and why.
/// has_cover_raster   a layer says from a raster what covers the ground
std::string climate_in_words(const WorldOptions& options, bool has_cover_raster);

}  // namespace terracast::tiler
