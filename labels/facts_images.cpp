#include "labels/facts_images.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <mutex>

#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/log.h"
#include "core/progress.h"
#include "labels/images.h"
#include "labels/label_image.h"

namespace terracast::labels {

namespace fs = std::filesystem;

std::vector<std::byte> FactsImage::exr(std::vector<core::ExrChannel> channels) const {
  return encode_label_image(source, camera.intrinsics, kind, std::move(channels));
}

std::string facts_image_path(const capture::CameraCalibration& camera, int frame,
                             const std::string& extension) {
  return fmt::format("{}/{}/{:06}{}", camera.rig, camera.name, frame, extension);
}

LabelFiles make_facts_images(const LabelInputs& inputs, const FactsImages& images,
                             const std::function<void(core::Json&)>& more) {
  const capture::SequenceReader& sequence = inputs.sequence;
  const auto& cameras = sequence.info().cameras;
  const fs::path folder = sequence.folder() / capture::kLabelsFolder / images.kind;
  const std::string source = capture::labels_source(sequence);
  std::vector<std::unique_ptr<geo::CameraModel>> models;
  for (const auto& camera : cameras) models.push_back(geo::make_camera(camera.intrinsics));

  const fs::path index_file = folder / (images.kind + ".json");
  std::once_flag is_index_removed;
  core::Progress progress(inputs.context, "images", num_images(sequence));
  for_each_image(sequence, [&](int frame, int camera) {
    const auto at = static_cast<std::size_t>(camera);
    const capture::CameraView view = sequence.view(*models[at], frame, camera);
    const capture::CameraFrame facts =
        sequence.read_camera(frame, camera, capture::SequenceReader::kFacts);
    const std::int64_t number = frame * static_cast<std::int64_t>(cameras.size()) + camera;
    const std::vector<std::byte> bytes =
        images.encode({cameras[at], view, facts, number, images.kind, source});
    const fs::path file = folder / facts_image_path(cameras[at], frame, images.extension);
    if (holds(file, bytes)) {
      progress.skip();
      return;
    }
    std::call_once(is_index_removed, [&] { remove_index(index_file); });
    core::write_file(file, bytes);
    progress.advance();
  });

  LabelFiles files = {images.kind + ".json"};
  for (const auto& camera : cameras)
    for (int frame = 0; frame < static_cast<int>(sequence.frames().size()); ++frame)
      files.insert(facts_image_path(camera, frame, images.extension));
  core::Json index = begin_index(images.kind, 1, sequence, images.channels);
  index.set("files", "<rig>/<camera>/NNNNNN" + images.extension);
  if (more) more(index);
  write_index(index_file, index, images.index_indent);
  return files;
}

}  // namespace terracast::labels
