#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace terracast::tiler {

struct LayerInputs;

/// What a layer's sources say of ground that a country from a seed would else make up. World x and y, m.
struct SurveyedGround {
  using Ring = std::vector<Eigen::Vector2d>;
  std::vector<Ring> buildings;  ///< round those that stand: nothing runs through them
  std::vector<Ring>
      areas;  ///< round ground all of whose buildings are known: no others stand there
  std::string content_hash;  ///< empty: nothing is surveyed
};

/// Of options of layers (LayerKind) whose sources say so.
class GroundSurvey {
 public:
  virtual ~GroundSurvey() = default;
  /// Asked once, before the country of a world is made, in worlds that have one.
  /// inputs   as for LayerKind::make(), without earlier layers and a country
  /// throws   as LayerKind::make()
  virtual SurveyedGround surveyed_ground(const LayerInputs& inputs) const = 0;
};

}  // namespace terracast::tiler
