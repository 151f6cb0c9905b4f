#pragma once

namespace terracast::tiler {

/// Of a layer whose cover() never tells of water: it is not asked where another layer has told of a place, nor
/// whether there is water.
class DryCover {
 public:
  virtual ~DryCover() = default;
};

}  // namespace terracast::tiler
