#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame_reader.h"
#include "core/choice.h"
#include "core/context.h"
#include "core/schema.h"
#include "scene/moving/moving_bodies.h"
#include "world/tile_store.h"

/// Labels that are made after a sequence was captured, because not everybody wants them: from its facts and
/// its world, without rendering again.
namespace terracast::labels {

/// The finished sequences of a job.
struct JobCaptures {
  std::span<const capture::SequenceReader> sequences = {};
  /// What moves in one of them, in the order of its bodies; its shapes alone count.
  std::function<std::vector<scene::MovingThing>(const capture::SequenceInfo&)> things_of = nullptr;
};

struct LabelInputs {
  const capture::SequenceReader& sequence;
  const world::TileStore& store;  ///< the world that it shows
  /// What moves in it, in the order of its bodies; its shapes alone count.
  std::span<const scene::MovingThing> things;
  const scene::MovingBodies& moving;  ///< the same as captured
  const core::Context& context;
  const JobCaptures& job;  ///< none: the sequence alone
};

/// What is known of a sequence before it is captured.
struct SequenceOutline {
  std::string name;
  std::vector<capture::CameraCalibration> cameras;
  int num_frames = 0;
  double rate_hz = 10.0;
  bool shares_geometry = false;  ///< with all others that do
  bool has_bottom_range = true;  ///< its facts hold bottom_range_m
};

/// Files of a kind of labels, relative to its folder `labels/<kind>` in the capture.
using LabelFiles = std::set<std::filesystem::path>;

/// One kind of labels. The derived class holds its options, describes their keys, and makes them.
class LabelMaker {
 public:
  virtual ~LabelMaker() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<LabelMaker> clone() const = 0;

  /// Holds options against all sequences that shall be labelled, before work is done for them.
  /// log      is told of what makes nothing in one of them
  /// throws   Config: options that name what no sequence has, or that make nothing in any
  virtual void check(std::span<const SequenceOutline> sequences, const core::Log& log) const;

  /// Writes into the sequence's folder `labels/<kind>`, in parallel; what an earlier run of the same capture
  /// and options finished is kept.
  /// returns       all its files; what else stands in the folder is of other options, and is removed
  /// determinism   same capture, world and options, same bytes, whatever the threads and interruptions
  /// throws        Input: damaged, or the world is not the sequence's; Io
  virtual LabelFiles make(const LabelInputs& inputs) const = 0;
};

struct LabelInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<LabelMaker> (*make)();
};

/// The table of kinds, alphabetical.
std::span<const LabelInfo> labels();

/// A `[[labels]]` of a config: the kind, and the kind's own keys beside it.
struct LabelOptions {
  std::string kind;

  LabelOptions() = default;
  /// A kind with its defaults.
  explicit LabelOptions(std::string_view kind_name);

  void describe(core::SchemaVisitor& visit);
  /// throws Config: as the kind's own validate()
  void validate() const;
  const LabelMaker& maker() const { return *maker_; }

 private:
  core::KindOptions<LabelInfo> maker_;
};

/// throws   as LabelMaker::check; the message names the kind
void check_labels(const std::vector<LabelOptions>& labels,
                  std::span<const SequenceOutline> sequences, const core::Log& log);

/// What moves in a finished sequence, as it was captured.
/// things   as LabelInputs has them
/// throws   Input: it was captured with other things
scene::MovingBodies captured_bodies(const capture::SequenceReader& sequence,
                                    std::span<const scene::MovingThing> things);

/// Makes labels of a finished sequence, and removes from their folders what is stale.
/// things   what moves in it, as LabelInputs has it
/// job      the sequences beside which it was captured, for labels of several
/// throws   Input: it was captured with other things; as LabelMaker::make; the message names the kind and the
///          sequence
void run_label_stage(const capture::SequenceReader& sequence, const world::TileStore& store,
                     std::span<const scene::MovingThing> things,
                     const std::vector<LabelOptions>& labels, const core::Context& context,
                     const JobCaptures& job = {});

}  // namespace terracast::labels
