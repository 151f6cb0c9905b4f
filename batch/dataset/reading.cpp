#include "batch/dataset/reading.h"

#include <algorithm>
#include <array>

namespace terracast::batch {

namespace {

const std::vector<FormatReading>& readings() {
  static const std::vector<FormatReading> table = {
      {"coco",
       "COCO",
       "`pycocotools.coco.COCO(\"annotations/instances.json\")` reads masks and boxes of the "
       "images in "
       "`images`; `panopticapi` takes `annotations/panoptic.json` and the images in `panoptic`.",
       {"object-detection", "instance-segmentation", "panoptic-segmentation"}},
      {"colmap",
       "COLMAP",
       "Each `<sequence>` has its model in `sparse/0` (as text in `sparse_txt/0`) and its images "
       "in "
       "`images`, for COLMAP's own programs, `pycolmap.Reconstruction(\"…/sparse/0\")` and "
       "whatever "
       "takes COLMAP's models; `numpy.load` reads `depth/**/*.npy` (planar, m, sky 0).",
       {"structure-from-motion", "novel-view-synthesis"}},
      {"euroc",
       "EuRoC (ASL)",
       "Each `<sequence>` has the folder `mav0` that readers of EuRoC's layout ask for (images and "
       "samples by their time in ns, UTC); `kalibr` and `openvins` hold the calibration for these "
       "programs, and `numpy.load` reads `range/*/*.npy` (along the ray, m, sky +inf).",
       {"visual-inertial-odometry", "stereo", "visual-odometry"}},
      {"kitti",
       "KITTI odometry",
       "`pykitti.odometry(\"…/dataset\", \"00\")` opens a sequence; `numpy.load` reads "
       "`depth_2/*.npy` "
       "(planar, m, sky 0), and `disp_2/*.png` are disparities times 256.",
       {"stereo", "visual-odometry"}},
      {"kitti_object",
       "KITTI object",
       "`training` has images, calibration and labels of KITTI's object task; boxes stand in the "
       "levelled "
       "frame of each image's `R0_rect`.",
       {"object-detection", "3d-object-detection"}},
      {"kitti_raw",
       "KITTI raw",
       "`pykitti.raw(\"…\", \"<date>\", \"<drive>\")` opens a drive with its OXTS packets on true "
       "WGS84; "
       "`numpy.load` reads `depth_02/data/*.npy` (planar, m, sky 0).",
       {"stereo", "visual-inertial-odometry"}},
      {"mcap",
       "MCAP (ROS 2)",
       "Each `<sequence>` is a bag of ROS 2 (`ros2 bag play`, or `<sequence>.mcap` in Foxglove and "
       "other readers of MCAP): images, camera_info, depth (planar, m, sky +inf), every sensor's "
       "samples, `/tf` and `/truth/odometry`, by their time in ns, UTC.",
       {"visual-inertial-odometry", "visual-odometry", "depth-estimation"}},
      {"tartanair",
       "TartanAir V2",
       "The package `tartanair` takes the folder as its root; "
       "`cv2.imread(file, cv2.IMREAD_UNCHANGED).view(\"<f4\")` decodes a depth image (planar, m), "
       "and "
       "`dataset.json` says what depth the sky has.",
       {"stereo", "optical-flow", "semantic-segmentation", "visual-odometry"}},
      {"tartanair_v1",
       "TartanAir V1",
       "`numpy.load` reads depth (planar, m), classes, flow and its mask; poses are lines of "
       "`tx ty tz qx qy qz qw` in north, east, down.",
       {"stereo", "optical-flow", "semantic-segmentation", "visual-odometry"}},
      {"terracast",
       "Rays and ranges",
       "`numpy.load` reads `rays.npy` and `range/*.npy`, whose product is each pixel's point in "
       "the "
       "camera's frame; flow, masks, classes, instances and normals lie beside them, poses in "
       "`poses.csv`.",
       {"depth-estimation", "optical-flow", "semantic-segmentation", "instance-segmentation",
        "visual-odometry"}},
      {"tum",
       "TUM RGB-D",
       "Each `<sequence>/<rig>/<camera>` is a sequence of TUM's RGB-D benchmark: `rgb.txt`, "
       "`depth.txt` and `associations.txt` list images by their time, `dataset.json` says what a "
       "metre counts in `depth/*.png` (planar, 0 where there is none), and `evo_traj tum` opens "
       "`groundtruth.txt`; `numpy.load` reads `range/*.npy` (along the ray, m, sky +inf).",
       {"depth-estimation", "visual-odometry", "visual-inertial-odometry"}},
  };
  return table;
}

}  // namespace

FormatReading reading_of(std::string_view format) {
  for (const FormatReading& reading : readings())
    if (reading.format == format) return reading;
  return {format, format, "`dataset.json` describes it.", {}};
}

std::string_view mime_type(std::string_view extension) {
  struct Type {
    std::string_view extension, mime;
  };
  static constexpr std::array kTypes = {
      Type{"csv", "text/csv"},
      Type{"db", "application/vnd.sqlite3"},
      Type{"html", "text/html"},
      Type{"json", "application/json"},
      Type{"jsonl", "application/jsonlines"},
      Type{"las", "application/vnd.las"},
      Type{"md", "text/markdown"},
      Type{"npz", "application/zip"},
      Type{"png", "image/png"},
      Type{"txt", "text/plain"},
      Type{"yaml", "application/yaml"},
  };
  const auto* found = std::find_if(kTypes.begin(), kTypes.end(),
                                   [&](const Type& type) { return type.extension == extension; });
  return found == kTypes.end() ? "application/octet-stream" : found->mime;
}

}  // namespace terracast::batch
