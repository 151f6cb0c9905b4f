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

}  // namespace terracast::tiler
