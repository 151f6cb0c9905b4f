#include "tests/validate/mutations/mutations.h"

#include <cmath>
#include <map>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"
#include "tests/validate/mutations/edits.h"

namespace terracast::test {

namespace {

/// The pair's grey images, as KITTI has them beside the colours.
void add_grey(const RightDataset& d) {
  for (std::size_t c = 0; c < 2; ++c) {
    std::string name = d.recording.cameras[c].name;
    name.back() = static_cast<char>('0' + c);
    RightDataset grey = d;
    grey.recording.cameras[c].name = name;
    for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
      const core::Image8& color = d.recording.color[c][f];
      core::Image8 luma(color.width(), color.height(), 1);
      for (std::size_t i = 0; i < luma.data().size(); ++i)
        luma.data()[i] = static_cast<std::uint8_t>(std::lround(0.299 * color.data()[3 * i] +
                                                               0.587 * color.data()[3 * i + 1] +
                                                               0.114 * color.data()[3 * i + 2]));
      core::write_file(d.folder / color_file(grey, c, f), core::encode_png(luma));
    }
    if (d.format == "kitti_raw")
      copy_over(d.folder / sequence_path(d) / "oxts/timestamps.txt",
                d.folder / sequence_path(d) / name / "timestamps.txt");
  }
  list_files_again(d.folder);
}

void remove_last_frame(Recording& recording) {
  for (auto* list : {&recording.body_world, &recording.velocity_mps, &recording.acceleration_mps2,
                     &recording.rate_body_radps})
    list->pop_back();
  recording.world_from_body.pop_back();
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    recording.color[c].pop_back();
    recording.depth[c].pop_back();
    recording.classes[c].pop_back();
  }
}

}  // namespace

RightDataset write_right_dataset(const std::string& format, Path path, const fs::path& folder) {
  static std::map<Path, Recording> tartan;
  RightDataset d;
  d.format = format;
  d.path = path;
  d.folder = folder;
  constexpr int kFrames = 6, kTartanFrames = 3, kMore = 3;
  if (format.starts_with("tartanair")) {
    if (!tartan.contains(path))
      tartan[path] = record_island_flight(tartanair_cameras(), kTartanFrames + 1, path);
    d.recording =
        format == "tartanair" ? tartan[path] : cropped(tartan[path], tartanair_v1_cameras());
    d.longer = island_path(d.recording.cameras, kTartanFrames + kMore, path);
  } else {
    const auto cameras = format == "kitti"       ? kitti_cameras()
                         : format == "kitti_raw" ? kitti_raw_cameras()
                                                 : colmap_cameras();
    d.recording = record_island_flight(cameras, kFrames + 1, path);
    d.longer = island_path(cameras, kFrames + kMore, path);
  }
  d.next_color = d.recording.color[0].back();
  remove_last_frame(d.recording);
  if (format == "tartanair") write_tartanair(d.recording, folder);
  if (format == "tartanair_v1") write_tartanair_v1(d.recording, folder);
  if (format == "kitti") write_kitti(d.recording, folder);
  if (format == "kitti_raw") write_kitti_raw(d.recording, folder);
  if (format == "colmap") write_colmap(d.recording, folder);
  if (format.starts_with("kitti")) add_grey(d);
  return d;
}

const std::vector<Mutation>& mutations() {
  static const std::vector<Mutation> list = [] {
    std::vector<Mutation> all;
    add_camera_mutations(all);
    add_pose_mutations(all);
    add_time_mutations(all);
    add_depth_mutations(all);
    add_flow_mutations(all);
    add_color_mutations(all);
    add_georeference_mutations(all);
    add_label_mutations(all);
    add_file_mutations(all);
    add_order_mutations(all);
    add_point_mutations(all);
    add_place_mutations(all);
    add_far_depth_mutations(all);
    return all;
  }();
  return list;
}

const std::vector<Unseeable>& unseeable_mutations() {
  static const std::vector<Unseeable> list = {
      {"RatesInDegrees", "kitti_raw", "turn rates of a straight flight are 0 in any unit", true},
      {"RotationsTransposed", "kitti",
       "between frames of a straight flight nothing turns: the rotations are 1, and so are their "
       "transposes",
       true},
      {"RotationsTransposed", "kitti_raw",
       "poses.txt holds rotations between frames alone: as above", true},
      {"AllPosesShifted", "tartanair",
       "in steady motion a shift of all images against all poses changes nothing between images",
       true},
      {"AllPosesShifted", "tartanair_v1", "as above", true},
      {"AllPosesShifted", "kitti", "as above", true},
      {"AllPosesShifted", "kitti_raw", "as above", true},
      {"AllPosesShifted", "colmap", "as above", true},
      {"ImagesHalfAPixelOff", "tartanair_v1",
       "all images of a level straight flight are off alike: the ground moves by the same in each, "
       "and what relief tells "
       "of half a pixel is less than patches of these few images do",
       true},
      {"RollForPitch", "kitti_raw", "a level flight has neither", true},
      {"PlacesShiftedBack", "kitti",
       "the first row, which is right, places the poses: in steady motion poses a frame late look "
       "the same",
       true},
      {"HalfPixel", "", "the intrinsics are the format's own: no file holds any"},
      {"HalfPixelOfFlow", "", "the format holds no flow"},
      {"FocalLength", "", "the intrinsics are the format's own: no file holds any"},
      {"CalibrationOfOtherSize", "", "the intrinsics are the format's own: no file holds any"},
      {"CalibrationBeforeChange", "", "the intrinsics are the format's own: no file holds any"},
      {"PosesSwapped", "", "one file or packet holds the poses of all cameras"},
      {"FlowSign", "", "the format holds no flow"},
      {"FlowOrder", "", "the format holds no flow"},
      {"FlowBackward", "", "the format holds no flow"},
      {"FlowToTheFrameAfter", "", "the format holds no flow"},
      {"FlowScaled", "", "the format holds no flow"},
      {"MasksInverted", "", "the format holds no flow"},
      {"DisparityDoubled", "", "the format holds no disparity"},
      {"DisparityScaled", "", "the format holds no disparity"},
      {"MountTurned", "", "the calibration knows no rotations of its cameras"},
      {"DepthsSwapped", "", "the format holds depth of one camera"},
      {"ImagesSwapped", "", "the format holds depth of one camera: its colours swapped are named"},
      {"ChannelOrderOfOneCamera", "", "it is ChannelOrder: of two cameras one is wrong there"},
      {"TimesOfOtherFileShifted", "", "the format holds times once"},
      {"AllTimesShifted", "", "the format holds times once: it is TimesShifted"},
      {"TranslationsOfFloat32", "", "the format holds no translations that are products"},
      {"PacketsLatitudeForLongitude", "", "the format holds no packets"},
      {"PacketsInRadians", "", "the format holds no packets"},
      {"PacketsArcSecond", "", "the format holds no packets"},
      {"YawFromNorth", "", "the format holds no packets"},
      {"RollForPitch", "", "the format holds no packets"},
      {"VelocitiesInKmh", "", "the format holds no velocities"},
      {"ForcesInG", "", "the format holds no forces"},
      {"FlowSignOfU", "", "the format holds no flow"},
      {"FlowSignOfV", "", "the format holds no flow"},
      {"FlowToTheFrameBefore", "", "the format holds no flow"},
      {"FlowOfTheNextPair", "", "the format holds no flow"},
      {"FlowOfThePairBefore", "", "the format holds no flow"},
      {"CovisibleMasksInverted", "", "the format does not hold the two masks apart"},
      {"ViewMasksInverted", "", "the format holds no masks of the field of view"},
      {"MasksSwapped", "", "the format holds no backward flow"},
      {"DisparityInWholePixels", "", "the format holds no disparity"},
      {"AnglesInDegrees", "", "the format holds no angles"},
      {"AnglesOfTheWorldsOrigin", "", "the format holds no packets"},
      {"VelocitiesSwapped", "", "the format holds no velocities"},
      {"RatesInDegrees", "", "the format holds no turn rates"},
      {"GravityLeftOut", "", "the format holds no forces"},
      {"ClassesPermuted", "", "the format holds no classes"},
      {"ClassesOfOneFramePermuted", "", "the format holds no classes"},
      {"ObservationsHalfAPixelOff", "", "the format holds no points"},
      {"TracksOfOtherFrame", "", "the format holds no points"},
      {"PointsMoved", "", "the format holds no points"},
      {"PointsScaled", "", "the format holds no points"},
      {"PointsInMillimetres", "", "the format holds no points"},
      {"PointsInNed", "", "the format holds no points"},
      {"PointsTurned", "", "the format holds no points"},
      {"RegistrationInEcef", "", "the format holds no georegistration.txt"},
      {"RegistrationInEnu", "", "the format holds no georegistration.txt"},
      {"RegistrationInNed", "", "the format holds no georegistration.txt"},
      {"RegistrationLatitudeForLongitude", "", "the format holds no georegistration.txt"},
      {"RegistrationInRadians", "", "the format holds no georegistration.txt"},
      {"RegistrationAboveGeoid", "", "the format holds no georegistration.txt"},
      {"RegistrationHeightsDown", "", "the format holds no georegistration.txt"},
      {"RegistrationTooHigh", "", "the format holds no georegistration.txt"},
      {"RegistrationOfOtherFrame", "", "the format holds no georegistration.txt"},
      {"PosesOfImagesPermuted", "", "a file or its rows hold the poses of one camera"},
      {"ChannelOrderOfAllCameras", "", "it is ChannelOrder: grey images or points tell"},
      {"FlowOffset", "", "the format holds no flow"},
      {"FlowOneColumnOff", "", "the format holds no flow"},
      {"BackwardFlowIsMinusForward", "", "the format holds no backward flow"},
      {"MasksAllOne", "", "the format holds no flow"},
      {"MasksAllZero", "", "the format holds no flow"},
      {"FlowReversed", "", "the format holds no flow"},
      {"DisparityOfTheRightCamera", "", "the format holds no disparity"},
      {"GravityLeftOutOfBodyAxes", "", "the format holds no forces"},
      {"GravityLeftOutOfLevelAxes", "", "the format holds no forces"},
      {"GravityLeftOutOfBothUps", "", "the format holds no forces"},
      {"GravityDownwards", "", "the format holds no forces"},
      {"DepthOfOneCameraScaled", "", "the format holds depth of one camera: it is DepthScaled"},
  };
  return list;
}

void corrupt(const RightDataset& right, const Mutation& mutation, const fs::path& folder) {
  // Links cost nothing; what is corrupted is written beside and renamed, so that the right dataset
  // keeps its own.
  fs::copy(right.folder, folder, fs::copy_options::recursive | fs::copy_options::create_hard_links);
  copy_over(right.folder / "dataset.json", folder / "dataset.json");
  mutation.corrupt(right, folder);
  if (mutation.is_listed) list_files_again(folder);
}

}  // namespace terracast::test
