#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "validate/dataset.h"

namespace terracast::validate {

/// Which images a check could judge one by one: what is wrong with another one alone it would not have shown.
class JudgedImages {
 public:
  void add(int camera, int frame) { images_.insert({camera, frame}); }

  /// Names of cameras that have files of a kind which were not all judged.
  /// file   of a frame, of which some formats have none for some cameras
  std::vector<std::string> unseen_parts(const Sequence& sequence,
                                        std::string FrameFiles::*file) const;

 private:
  std::set<std::pair<int, int>> images_;  ///< camera and frame
};

}  // namespace terracast::validate
