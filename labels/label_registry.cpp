#include <array>

#include "capture/sequence_files.h"
#include "core/registry.h"
#include "labels/label.h"
#include "labels/stale.h"
#include "sensors/moving_record.h"

// Every kind of labels, in alphabetical order: X(name) is render/labels/name.cpp, which defines `LabelInfo
// name_label()`.
// clang-format off
#define TERRACAST_LABELS(X)                                                                \
  X(albedo) X(bottom) X(cloud) X(covisibility) X(depth) X(disparity) X(flow) X(instance)   \
  X(normals) X(objects) X(pairs) X(panoptic) X(points) X(range) X(scene_flow) X(semantic)  \
  X(tracks) X(volume)
// clang-format on

namespace terracast::labels {

#define TERRACAST_DECLARE(name) LabelInfo name##_label();
TERRACAST_LABELS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const LabelInfo> labels() {
#define TERRACAST_ENTRY(name) name##_label(),
  static const std::array table = {TERRACAST_LABELS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

void LabelMaker::check(std::span<const SequenceOutline>, const core::Log&) const {}

LabelOptions::LabelOptions(std::string_view kind_name) : kind(kind_name) {
  maker_.set(kind, core::find_registered(labels(), "label", kind_name).make());
}

void LabelOptions::describe(core::SchemaVisitor& visit) {
  visit.key("kind", kind, "Labels to make of every sequence.",
            core::required(core::one_of(core::registry_names(labels()))));
  // A list of keys without a config has none.
  if (!kind.empty()) maker_.describe(visit, labels(), "label", kind);
}

void LabelOptions::validate() const {
  core::with_context([&] { maker_.validate(); }, fmt::format("reading the labels {}", kind));
}

void check_labels(const std::vector<LabelOptions>& labels,
                  std::span<const SequenceOutline> sequences, const core::Log& log) {
  for (const LabelOptions& options : labels)
    core::with_context([&] { options.maker().check(sequences, log); },
                       fmt::format("checking the labels {}", options.kind));
}

scene::MovingBodies captured_bodies(const capture::SequenceReader& sequence,
                                    std::span<const scene::MovingThing> things) {
  if (sensors::describe_moving(things) != sequence.info().moving)
    core::fail(core::ErrorKind::Input,
               "the things that move in sequence {} are not those of this program: render it again",
               sequence.info().name);
  return sensors::captured_bodies(things, sequence.frames());
}

void run_label_stage(const capture::SequenceReader& sequence, const world::TileStore& store,
                     std::span<const scene::MovingThing> things,
                     const std::vector<LabelOptions>& labels, const core::Context& context,
                     const JobCaptures& job) {
  if (labels.empty()) return;
  const scene::MovingBodies moving = captured_bodies(sequence, things);
  for (const LabelOptions& options : labels)
    core::with_context(
        [&] {
          const LabelFiles files =
              options.maker().make({sequence, store, things, moving, context, job});
          remove_stale_files(sequence.folder() / capture::kLabelsFolder / options.kind, files,
                             context.log);
        },
        fmt::format("making the labels {} of sequence {}", options.kind, sequence.info().name));
}

}  // namespace terracast::labels
