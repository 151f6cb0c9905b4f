#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame_reader.h"
#include "core/context.h"
#include "core/schema.h"
#include "render/moving_bodies.h"
#include "world/tile_store.h"

/// Labels that are made after a sequence was captured, because not everybody wants them: from its facts and
/// its world, without rendering again.
namespace terracast::render {

/// The finished sequences of a job.
struct JobCaptures {
  std::span<const capture::SequenceReader> sequences = {};
  /// What moves in one of them, in the order of its bodies; its shapes alone count.
  std::function<std::vector<MovingThing>(const capture::SequenceInfo&)> things_of = nullptr;
};

/// What is known of a sequence before it is rendered.
struct SequenceOutline {
  std::string name;
  std::vector<double> times_s;  ///< of its frames, after its first
  std::vector<capture::CameraCalibration> cameras;
};

struct JobOutline {
  std::vector<SequenceOutline> sequences;
  bool has_one_geometry = false;  ///< all of them show the same
};

struct LabelInputs {
  const capture::SequenceReader& sequence;
  const world::TileStore& store;  ///< the world that it shows
  /// What moves in it, in the order of its bodies; its shapes alone count.
  std::span<const MovingThing> things;
  const MovingBodies& moving;  ///< the same as captured
  const core::Context& context;
  const JobCaptures& job;  ///< none: the sequence alone
};

/// One kind of labels. The derived class holds its options, describes their keys, and makes them.
class LabelMaker {
 public:
  virtual ~LabelMaker() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws Config: options that contradict each other
  virtual void validate() const {}
  /// throws Config: what a job's sequences cannot have, such as a camera that none has
  virtual void check(const JobOutline& job) const { static_cast<void>(job); }
  virtual std::unique_ptr<LabelMaker> clone() const = 0;

  /// Writes into the sequence's folder `labels/<kind>`, in parallel; what an earlier run of the same capture
  /// and options finished is kept.
  /// determinism   same capture, world and options, same bytes, whatever the threads and interruptions
  /// throws        Input: damaged, or the world is not the sequence's; Io
  virtual void make(const LabelInputs& inputs) const = 0;
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
  LabelOptions(const LabelOptions& other);
  LabelOptions& operator=(const LabelOptions& other);
  LabelOptions(LabelOptions&&) noexcept = default;
  LabelOptions& operator=(LabelOptions&&) noexcept = default;

  void describe(core::SchemaVisitor& visit);
  /// throws Config: as the kind's own validate()
  void validate() const;
  const LabelMaker& maker() const { return *maker_; }

 private:
  std::unique_ptr<LabelMaker> maker_;
};

/// What moves in a finished sequence, as it was captured.
/// things   as LabelInputs has them
/// throws   Input: it was captured with other things
MovingBodies captured_bodies(const capture::SequenceReader& sequence,
                             std::span<const MovingThing> things);

/// Makes labels of a finished sequence.
/// things   what moves in it, as LabelInputs has it
/// job      the sequences beside which it was captured, for labels of several
/// throws   Input: it was captured with other things; as LabelMaker::make; the message names the kind and the
///          sequence
void run_label_stage(const capture::SequenceReader& sequence, const world::TileStore& store,
                     std::span<const MovingThing> things, const std::vector<LabelOptions>& labels,
                     const core::Context& context, const JobCaptures& job = {});

}  // namespace terracast::render
