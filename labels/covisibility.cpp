// How much of each image every other one shows: of pixels on a grid, how many points of the world they show lie
// within the other image, and how many of these are seen there. By rays to the very points.

#include <algorithm>
#include <cmath>

#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/stop.h"
#include "labels/finished.h"
#include "labels/label.h"
#include "labels/matches.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::Json;

/// The middles of whole cells of a grid over an image.
std::vector<Eigen::Vector2i> grid_pixels(const geo::CameraIntrinsics& image, int step_px) {
  std::vector<Eigen::Vector2i> pixels;
  for (int y = step_px / 2; y < image.height_px; y += step_px)
    for (int x = step_px / 2; x < image.width_px; x += step_px) pixels.emplace_back(x, y);
  return pixels;
}

class CovisibilityLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("step_px", step_px_, "Every so many columns and rows a pixel is asked.",
              core::between(1, 4096));
    visit.key("reach_frames", reach_frames_,
              "Images at most so many frames apart are compared; -1: all of the sequence.",
              core::between(-1, 1000000));
  }
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<CovisibilityLabel>(*this);
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const fs::path folder = sequence.folder() / capture::kLabelsFolder / "covisibility";
    const LabelFiles files = {"covisibility.csv", "covisibility.json"};
    Json record = Json::object();
    record.set("format", "terracast covisibility")
        .set("version", 1)
        .set("capture", capture::labels_source(sequence))
        .set("step_px", step_px_)
        .set("reach_frames", reach_frames_);
    if (is_label_finished(folder / "covisibility.json", folder / "covisibility.csv", record)) {
      inputs.context.log.info("{}: its table of covisibility is there already",
                              sequence.info().name);
      return files;
    }
    const std::string text = table(inputs);
    core::write_file(folder / "covisibility.csv", text);
    record.set("xxh3_128", core::content_hash(text));
    record.write(folder / "covisibility.json");
    return files;
  }

 private:
  /// Pairs one after the other, the points of each in parallel.
  std::string table(const LabelInputs& inputs) const {
    const capture::SequenceReader& sequence = inputs.sequence;
    const Matcher matcher(sequence, inputs.store, inputs.moving);
    const auto num_frames = static_cast<int>(sequence.frames().size());
    const auto num_cameras = static_cast<int>(sequence.info().cameras.size());
    core::Progress progress(inputs.context, "images", std::int64_t{num_frames} * num_cameras);
    std::string text = "frame,camera,other_frame,other_camera,asked,in_image,seen,share_seen\n";
    for (int frame = 0; frame < num_frames; ++frame) {
      for (int camera = 0; camera < num_cameras; ++camera) {
        add_rows(sequence, matcher, {frame, camera}, text);
        progress.advance();
      }
    }
    return text;
  }

  void add_rows(const capture::SequenceReader& sequence, const Matcher& matcher,
                const ImageOf& from, std::string& text) const {
    const auto& cameras = sequence.info().cameras;
    const auto name = [&](int camera) {
      const auto& one = cameras[static_cast<std::size_t>(camera)];
      return one.rig + "/" + one.name;
    };
    const std::vector<Eigen::Vector2i> pixels = grid_pixels(
        cameras[static_cast<std::size_t>(from.camera)].intrinsics, static_cast<int>(step_px_));
    std::vector<ShownPoint> points;
    for (const auto& point : matcher.points(from, pixels))
      if (point) points.push_back(*point);
    const auto num_frames = static_cast<int>(sequence.frames().size());
    for (int frame = 0; frame < num_frames; ++frame) {
      if (reach_frames_ >= 0 && std::abs(frame - from.frame) > reach_frames_) continue;
      for (int camera = 0; camera < static_cast<int>(cameras.size()); ++camera) {
        const ImageOf to{frame, camera};
        if (to == from) continue;
        core::throw_if_stop_asked();
        std::int64_t num_in_image = 0, num_seen = 0;
        for (const std::optional<Sighting>& sighting : matcher.follow(points, to)) {
          num_in_image += sighting && sighting->is_in_image ? 1 : 0;
          num_seen += sighting && sighting->is_visible ? 1 : 0;
        }
        text += fmt::format("{},{},{},{},{},{},{},{:.6f}\n", from.frame, name(from.camera), frame,
                            name(camera), pixels.size(), num_in_image, num_seen,
                            static_cast<double>(num_seen) / static_cast<double>(pixels.size()));
      }
    }
  }

  std::int64_t step_px_ = 16;
  std::int64_t reach_frames_ = -1;
};

}  // namespace

LabelInfo covisibility_label() {
  return {.name = "covisibility",
          .summary = "A table of how much of each image every other image of the sequence shows.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<CovisibilityLabel>();
          }};
}

}  // namespace terracast::labels
