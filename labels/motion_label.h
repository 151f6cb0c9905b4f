#pragma once

#include <set>
#include <string>
#include <vector>

#include "labels/pair_label.h"

namespace terracast::labels {

/// Pairs of images of one camera at two times.
class MotionLabel : public PairLabel {
 public:
  /// frames_apart   unless a config says others
  explicit MotionLabel(std::vector<std::int64_t> frames_apart)
      : frames_apart_(std::move(frames_apart)) {}

  void describe(core::SchemaVisitor& visit) override;
  void validate() const override;
  void check(std::span<const SequenceOutline> sequences, const core::Log& log) const override;

 protected:
  std::set<std::int64_t> frames_apart() const override {
    return {frames_apart_.begin(), frames_apart_.end()};
  }
  /// Every camera with itself.
  std::vector<PairRoute> routes_of(const LabelInputs& inputs) const override;
  /// <rig>/<camera>/NNNNNN_MMMMMM.exr
  std::string file_name(const PairRoute& route, const ImageOf& first,
                        const ImageOf& second) const override;

 private:
  std::vector<std::int64_t> frames_apart_;
};

}  // namespace terracast::labels
