#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame.h"
#include "capture/labels.h"
#include "core/image_io.h"
#include "core/json.h"
#include "labels/label.h"
#include "labels/label_index.h"

/// Labels that follow from the facts of a finished capture: a file an image, and no ray is cast.
namespace terracast::labels {

/// An image of a finished capture.
struct FactsImage {
  const capture::CameraCalibration& camera;
  const capture::CameraView& view;  ///< at the frame
  const capture::CameraFrame& facts;
  std::int64_t number = 0;  ///< as labels/images.h counts
  const std::string& kind;
  const std::string& source;  ///< capture::labels_source()

  /// An OpenEXR file of these channels, which says of which capture it is.
  std::vector<std::byte> exr(std::vector<core::ExrChannel> channels) const;
};

struct FactsImages {
  std::string kind;
  std::string extension;  ///< of its files, with the dot
  ChannelMeanings channels = {};
  int index_indent = 2;  ///< blanks a level; -1: one line, for long lists
  std::function<std::vector<std::byte>(const FactsImage&)> encode = nullptr;  ///< from many threads
};

/// Path of an image's file in the folder of a kind.
std::string facts_image_path(const capture::CameraCalibration& camera, int frame,
                             const std::string& extension);

/// Writes <rig>/<camera>/NNNNNN of all images, in parallel, then <kind>.json. A file that holds what it shall, to the
/// byte, is not touched; so what is damaged, or of another capture or other options, is made again; <kind>.json is
/// removed before the first such image.
/// more     members of the index, asked for after all images; null: none
/// throws   Io; Input: a damaged capture
LabelFiles make_facts_images(const LabelInputs& inputs, const FactsImages& images,
                             const std::function<void(core::Json&)>& more = nullptr);

/// A kind without options.
class PlainLabel : public LabelMaker {
 public:
  using Make = LabelFiles (*)(const LabelInputs&);
  explicit PlainLabel(Make make_files) : make_(make_files) {}
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<LabelMaker> clone() const override { return std::make_unique<PlainLabel>(*this); }
  LabelFiles make(const LabelInputs& inputs) const override { return make_(inputs); }

 private:
  Make make_;
};

}  // namespace terracast::labels
