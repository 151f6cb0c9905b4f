#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image_io.h"
#include "core/json.h"
#include "labels/label.h"
#include "labels/label_index.h"
#include "labels/matches.h"
#include "labels/pair_cameras.h"
#include "labels/pair_sight.h"

/// Labels of pairs of images: where what the one shows is in the other. Kinds differ in which pairs they make, and in
/// what they write of them.
namespace terracast::labels {

/// Cameras that are second, by the first.
using SecondCameras = std::map<int, std::set<int>>;

/// Of pairs that are named, those of one sequence whose cameras it carries.
SecondCameras named_pairs(std::span<const CameraPair> pairs, const std::string& sequence,
                          const std::vector<capture::CameraCalibration>& cameras);
/// Tells the log of those that it does not carry, while another sequence does.
/// throws   Config: none does
void tell_left_out(std::string_view kind, std::span<const CameraPair> pairs,
                   const LabelInputs& inputs);

/// From images of a sequence to its own, or to those of another.
struct PairRoute {
  const capture::SequenceReader& from;
  const capture::SequenceReader& to;
  SecondCameras seconds;

  bool is_across() const { return &from != &to; }
  const capture::CameraCalibration& first_camera(int camera) const {
    return from.info().cameras[static_cast<std::size_t>(camera)];
  }
  const capture::CameraCalibration& second_camera(int camera) const {
    return to.info().cameras[static_cast<std::size_t>(camera)];
  }
  bool has_pair(const ImageOf& first, const ImageOf& second) const;
};

/// What becomes of the point that a pixel shows, as files number it.
enum class Sight : std::uint32_t {
  NoPoint = 0,    ///< the sky, or no ray comes in
  Hidden = 1,     ///< in the other image, and hidden
  Seen = 2,       ///< in it, and seen
  OutOfView = 3,  ///< not in it: beyond its border, or behind the other camera
  /// What it is of is not there at that time, or bears the other camera, which does not see it.
  NotThere = 4,
};

/// Of all pixels of the first image, row by row.
struct PairImage {
  explicit PairImage(std::size_t num_pixels);
  /// To where the other image shows the point, or would beyond its border, px; of the sky by rotation alone. NaN: no
  /// ray, behind the other camera, not there, or the sky where the other camera's rays are parallel.
  std::vector<float> flow_x, flow_y;
  /// To where the point is at the time of the other frame, m, world's axes. NaN: the sky, no ray, not there.
  std::array<std::vector<float>, 3> scene_flow;
  std::vector<std::uint32_t> sight;  ///< Sight
  /// The instance that hides what is hidden; 0: the ground, or nothing.
  std::vector<std::uint32_t> occluder;
};

/// Meanings of channels, for indices of kinds that have them.
inline constexpr std::string_view kFlowMeaning =
    "float, px from the pixel's centre to where the other image shows the point, or would beyond "
    "its border; of the sky by rotation alone; NaN no ray, behind the other camera, not there, or "
    "the sky where the other camera's rays are parallel";
inline constexpr std::string_view kSceneFlowMeaning =
    "float, m along the world's axes, to where the point is at the time of the other frame; NaN "
    "sky, no ray or not there";
inline constexpr std::string_view kSightMeaning =
    "uint: 0 sky or no ray, 1 in the other image but hidden, 2 seen there, 3 out of its view, 4 "
    "not there at that time";
inline constexpr std::string_view kOccluderMeaning =
    "uint: instance id of what hides the point, in the sequence of the other image; 0 the ground, "
    "or nothing does";

/// A kind of such labels.
class PairLabel : public LabelMaker {
 public:
  /// A file a pair of images, then <kind>.json, which says which pairs there are and what each of them is; it is
  /// removed before the first file that is made.
  LabelFiles make(const LabelInputs& inputs) const final;

 protected:
  virtual std::string kind() const = 0;
  /// How many frames after the first image that of the second is.
  virtual std::set<std::int64_t> frames_apart() const = 0;
  virtual std::vector<PairRoute> routes_of(const LabelInputs& inputs) const = 0;
  /// Of channels of its files.
  virtual ChannelMeanings meanings() const = 0;
  /// What a file holds, `sight` among it, in alphabetical order; refers to the image, in which it may change values.
  virtual std::vector<core::ExrChannel> channels(const PairRoute& route, int first, int second,
                                                 PairImage& image) const = 0;
  /// A pair's file in the folder of the kind; by default <rig>/<camera>/[<sequence>/]<rig>/<camera>/NNNNNN_MMMMMM.exr.
  virtual std::string file_name(const PairRoute& route, const ImageOf& first,
                                const ImageOf& second) const;
  /// More members of the index, of two cameras.
  virtual void describe_pair(const PairRoute&, int, int, core::Json&) const {}

 private:
  void make_images(const LabelInputs& inputs, const PairRoute& route) const;
  void make_image(const PairRoute& route, const PairSight& sight, const ImageOf& from,
                  const std::set<int>& seconds) const;
  LabelFiles write_index_of(const capture::SequenceReader& sequence,
                            const std::vector<PairRoute>& routes) const;
  void list_files(const PairRoute& route, int first, int second, std::int64_t apart,
                  LabelFiles& all, core::Json& pairs) const;
};

}  // namespace terracast::labels
