#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

namespace terracast::tiler {

class Layer;
struct LayerInputs;

/// What a layer's sources say of ground that a country from a seed would else make up. World x and
/// y, m.
struct SurveyedGround {
  using Ring = std::vector<Eigen::Vector2d>;
  std::vector<Ring> buildings;  ///< round those that stand: nothing runs through them
  /// Round ground all of whose buildings are known: no others stand there.
  std::vector<Ring> areas;
  std::string content_hash;  ///< empty: nothing is surveyed
};

/// A layer's sources, read once: what they say of the ground, and the layer that is made of them.
class GroundSurvey {
 public:
  virtual ~GroundSurvey() = default;
  virtual const SurveyedGround& ground() const = 0;
  /// As LayerKind::make(), of what was read. Called once at most: the layer takes it over.
  /// inputs   as the survey's own, with earlier layers and a country
  virtual std::unique_ptr<Layer> make(const LayerInputs& inputs) = 0;
};

/// Of options of layers (LayerKind) whose sources may say so.
class SurveyingKind {
 public:
  virtual ~SurveyingKind() = default;
  /// Asked once, before its layer is made, and before the country of worlds that have one.
  /// inputs    as for LayerKind::make(), without earlier layers and a country
  /// returns   nothing where its sources say nothing; its layer is made by make() then
  /// throws    as LayerKind::make()
  virtual std::unique_ptr<GroundSurvey> survey(const LayerInputs& inputs) const = 0;
};

}  // namespace terracast::tiler
