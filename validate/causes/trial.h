#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/progress.h"
#include "validate/check.h"
#include "validate/frames.h"

/// What a diagnosis works on: some frames of a sequence, in which a supposed mistake is undone, and
/// the checks that then say whether they agree.
namespace terracast::validate {

/// Thrown where a diagnosis has done all that it may.
struct EffortSpent {};

/// What a diagnosis has done and may do: pairs of images compared by one check. Counted, not timed, so that it ends at
/// the same place on any machine and with any number of threads.
class Effort {
 public:
  /// progress  is advanced by what is done; may be null
  explicit Effort(std::int64_t bound, core::Progress* progress = nullptr)
      : bound_(bound), progress_(progress) {}
  /// throws  EffortSpent: that would be more than the bound
  void spend(std::int64_t comparisons);
  std::int64_t spent() const { return spent_; }
  std::int64_t bound() const { return bound_; }

 private:
  std::int64_t bound_ = 0;
  std::int64_t spent_ = 0;
  core::Progress* progress_ = nullptr;
};

/// Some frames and cameras of a sequence, numbered from 0, with times that start with them. Copies share their
/// images until one is changed.
struct Trial {
  const Dataset* dataset = nullptr;
  int first_frame = 0;           ///< in the sequence
  int num_cameras_left_out = 0;  ///< of the sequence
  Sequence sequence;             ///< part_of() it
  std::vector<FrameImages> images;
  std::shared_ptr<const ColmapModel> model;  ///< COLMAP: the binary one, of the whole sequence
  Pose local_from_first;                     ///< KITTI: what poses of the file are placed by
  Undulation undulation_m;                   ///< ValidateOptions'
  /// Whether the format's own poses have the body's first place at the origin, as
  /// `georeference_origin` wants it of georeference.csv, and its second elsewhere.
  bool begins_at_origin = false;
  Effort* effort = nullptr;  ///< of the diagnosis, which its trials share; null: without end

  /// Counts comparisons of pairs of images.
  void spend(std::size_t comparisons) const;
  int num_frames() const { return sequence.num_frames; }
  int num_cameras() const { return static_cast<int>(sequence.cameras.size()); }
  const LoadedImage& image(int camera, int frame) const {
    return *images[static_cast<std::size_t>(frame)][static_cast<std::size_t>(camera)];
  }
  /// A copy of an image, in the place of the one that was there.
  LoadedImage& edit(int camera, int frame);
  /// A copy of its flow, which is there, in the same way.
  FlowFields& edit_flow(int camera, int frame);
  const Camera& camera(int index) const {
    return sequence.cameras[static_cast<std::size_t>(index)];
  }
  Camera& camera(int index) { return sequence.cameras[static_cast<std::size_t>(index)]; }
  /// "image_2" for one camera, "image_2 and image_3", "all cameras"; of a part of them, that.
  std::string camera_names(const std::vector<int>& cameras) const;
};

/// How much of its bound each result takes: over 1 where it fails. Results that show nothing are
/// left out.
using Shares = std::map<std::string, double>;

/// Runs some checks (names of the registry; also "colmap_observations", "colmap_point_depths" and
/// "colmap_point_colors") on a trial.
/// cost  the sum of the checks on `kSamples` pixels of each pair; of `photometric` up to 160 patches;
///       `depth_unit` also sweeps a few pairs of a camera whose frames are apart
Shares measure(const Trial& trial, const std::vector<std::string_view>& checks);

/// The registry's check that a result belongs to; empty for COLMAP's model and the like.
std::string_view check_of(std::string_view result);

/// Loads the frames around the one that failed results name, of eight cameras at most: those that they name, and their
/// neighbours; images that only break a rule of the
/// format (a depth beyond the sky's, another size) are loaded all the same.
Trial make_trial(const Dataset& dataset, const Sequence& sequence,
                 const std::vector<CheckResult>& failed);

/// Places "camera, frame N" that a text of a check names; frames as in the text.
std::vector<std::pair<int, int>> places_in(const std::string& text, const Sequence& sequence);

/// Median |z predicted / z measured - 1| of a hundred pixels a pair, mean of the pairs of
/// neighbouring frames and of cameras that have depth; 1 for a pair that shares too little.
double depth_disagreement(const Trial& trial);
/// The same of 1 - correlation of patches.
double color_disagreement(const Trial& trial);

/// Cameras whose images may share a mistake: all, those with colours, each alone.
std::vector<std::vector<int>> groups_of_images(const Trial& trial);
/// Cameras whose images are not grey.
std::vector<int> colored_cameras(const Trial& trial);

/// Words of findings that follow from depths that are written otherwise: a depth that is none, a sky
/// that has one.
inline const std::vector<std::string> kUnfitDepth = {": depth ", "where depth is "};
inline const std::vector<std::string> kUnfitSize = {" pixels where "};
inline const std::vector<std::string> kUnfitClass = {": class "};
inline const std::vector<std::string> kUnfitPlace = {" is no place"};

/// A supposed cause.
struct Hypothesis {
  /// The checks that it must repair or leave right. All failed results of the first of them that
  /// fails must come within their bounds.
  std::vector<std::string_view> checks;
  /// Less is simpler; decides between causes that repair equally much.
  int rank = 0;
  /// Undoes the cause, and says it. Frames in words and members are the sequence's.
  /// returns  false where it does not apply
  std::function<bool(Trial&, Cause&)> undo;
  /// What is lost for good (steps of depth, blocks in colours) cannot be undone: the results named
  /// here are taken for explained where `undo` finds the marks of it, and nothing is looked for
  /// behind it.
  std::vector<std::string_view> marks = {};
};

/// What is known before hypotheses are made.
struct Symptoms {
  const Trial& trial;
  const Shares& shares;
  const std::vector<CheckResult>& failed;  ///< of the whole sequence

  bool fails(std::string_view check) const;  ///< any result of a check of the registry
  bool fails_result(std::string_view name) const;

  /// Of the trial as it is; computed once.
  double color_disagreement() const;
  double depth_disagreement() const;

  mutable std::optional<double> known_color_disagreement = {}, known_depth_disagreement = {};
};

/// One file of causes: adds its hypotheses.
using CauseMaker = void (*)(const Symptoms&, std::vector<Hypothesis>&);

}  // namespace terracast::validate
