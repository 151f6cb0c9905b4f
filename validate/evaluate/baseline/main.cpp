// terracast_baseline: what OpenCV's well-known methods make of an exported dataset, for a first number
// of `terracast evaluate`. Dense inverse search (DIS; Kroeger et al., ECCV 2016) for optical flow, semi-global
// block matching (SGBM; after Hirschmüller, PAMI 2008) for disparity. A program of its own: terracast links no OpenCV.

#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/atomic_file.h"
#include "core/environment.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "validate/evaluate/task.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr const char* kHelp =
    "usage: terracast_baseline flow|stereo DATASET --out RESULT [--sequence NAME]… [--camera "
    "NAME]…\n"
    "                          [--threads N]\n"
    "Writes RESULT/flow/SEQUENCE/CAMERA/NNNNNN.flo (from each frame to the next), or\n"
    "RESULT/disparity/SEQUENCE/CAMERA/NNNNNN.pfm (px, 0 where there is none).\n"
    "  terracast_baseline flow out/demo/export/kitti --out result\n"
    "  terracast evaluate --task flow --truth out/demo/export/kitti --result result/flow\n";

struct Arguments {
  std::string method;
  fs::path dataset, out;
  int num_threads = 0;
  EvaluateOptions chosen;  ///< its sequences and cameras
};

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  std::vector<std::string> places;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (!words[i].starts_with("--")) {
      places.push_back(words[i]);
      continue;
    }
    if (i + 1 == words.size()) fail(ErrorKind::Usage, "{} wants a value\n{}", words[i], kHelp);
    const std::string& value = words[i + 1];
    if (words[i] == "--out")
      arguments.out = value;
    else if (words[i] == "--sequence")
      arguments.chosen.sequences.push_back(value);
    else if (words[i] == "--camera")
      arguments.chosen.cameras.push_back(value);
    else if (words[i] == "--threads")
      arguments.num_threads = static_cast<int>(parse_integer(value, "--threads"));
    else
      fail(ErrorKind::Usage, "unknown option {}\n{}", words[i], kHelp);
    ++i;
  }
  constexpr int kMostThreads = 4096;
  if (places.size() != 2 || arguments.out.empty() || arguments.num_threads < 0 ||
      arguments.num_threads > kMostThreads || (places[0] != "flow" && places[0] != "stereo"))
    fail(ErrorKind::Usage, "{}", kHelp);
  arguments.method = places[0];
  arguments.dataset = places[1];
  return arguments;
}

cv::Mat grey_of(const Subject& subject, int camera_index, int frame) {
  const Camera& camera = subject.sequence.cameras[static_cast<std::size_t>(camera_index)];
  core::Image8 color = subject.reader().color(subject.dataset, camera, frame);
  const cv::Mat rgb(color.height(), color.width(), CV_8UC3, color.data().data());
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

bool has_color(const Subject& subject, int camera_index, int frame) {
  const Camera& camera = subject.sequence.cameras[static_cast<std::size_t>(camera_index)];
  return frame < subject.sequence.num_frames &&
         !camera.files[static_cast<std::size_t>(frame)].color.empty();
}

void write_flo(const fs::path& file, const cv::Mat& flow) {
  const float tag = 202021.25F;
  const std::int32_t width = flow.cols, height = flow.rows;
  std::vector<std::byte> bytes(12 + 8 * flow.total());
  std::memcpy(bytes.data(), &tag, 4);
  std::memcpy(bytes.data() + 4, &width, 4);
  std::memcpy(bytes.data() + 8, &height, 4);
  const std::size_t row_bytes = 8 * static_cast<std::size_t>(flow.cols);
  for (int y = 0; y < flow.rows; ++y)
    std::memcpy(bytes.data() + 12 + row_bytes * static_cast<std::size_t>(y), flow.ptr(y),
                row_bytes);
  core::write_file(file, bytes);
}

/// Debevec's floats: rows from the bottom up, little-endian where the scale is negative.
void write_pfm(const fs::path& file, const cv::Mat& values) {
  std::vector<std::byte> bytes;
  const auto append = [&](const void* data, std::size_t size) {
    const auto* const first = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), first, first + size);
  };
  const std::string header = fmt::format("Pf\n{} {}\n-1.0\n", values.cols, values.rows);
  append(header.data(), header.size());
  for (int y = values.rows - 1; y >= 0; --y)
    append(values.ptr(y), sizeof(float) * static_cast<std::size_t>(values.cols));
  core::write_file(file, bytes);
}

void make_flow(const Subject& subject, int frame, const fs::path& folder) {
  const int camera = subject.camera_index;
  if (!has_color(subject, camera, frame) || !has_color(subject, camera, frame + 1)) return;
  cv::Mat flow;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)
      ->calc(grey_of(subject, camera, frame), grey_of(subject, camera, frame + 1), flow);
  write_flo(folder / (frame_digits(frame) + ".flo"), flow);
}

void make_disparity(const Subject& subject, int frame, const fs::path& folder) {
  const StereoPair& pair = *subject.sequence.stereo;
  if (!has_color(subject, pair.left, frame) || !has_color(subject, pair.right, frame)) return;
  const cv::Mat left = grey_of(subject, pair.left, frame);
  // An eighth of the width, in steps of 16, as OpenCV's own example; penalties as it advises for 5 x 5 blocks.
  const int range = (left.cols / 8 + 15) / 16 * 16;
  constexpr int kBlock = 5;
  const auto matcher =
      cv::StereoSGBM::create(0, range, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 63, 10,
                             100, 2, cv::StereoSGBM::MODE_SGBM);
  cv::Mat sixteenths;
  matcher->compute(left, grey_of(subject, pair.right, frame), sixteenths);
  cv::Mat disparity_px;
  sixteenths.convertTo(disparity_px, CV_32F, 1.0 / 16.0);
  write_pfm(folder / (frame_digits(frame) + ".pfm"), cv::max(disparity_px, 0.0F));
}

void run(const Arguments& arguments) {
  const core::Log log("baseline", core::LogLevel::Info);
  const core::ThreadLimit limit(arguments.num_threads);
  // One thread a frame: DIS cuts an image into as many stripes as there are threads, and its result
  // depends on them.
  cv::setNumThreads(1);
  Findings findings;
  const Dataset dataset = read_dataset(arguments.dataset, "", findings);
  const bool is_flow = arguments.method == "flow";
  for (const Subject& subject : chosen_subjects(dataset, arguments.chosen)) {
    if (!is_flow &&
        (!subject.sequence.stereo || subject.sequence.stereo->left != subject.camera_index))
      fail(ErrorKind::Input, "{}: {} is not the left camera of a rectified pair",
           arguments.dataset.string(), subject.camera().name);
    const fs::path folder = arguments.out / (is_flow ? "flow" : "disparity") /
                            subject.sequence.name / subject.camera().name;
    core::make_folder(folder);
    core::Progress progress({.log = log, .num_threads = 0, .events_file = {}}, "frames",
                            subject.sequence.num_frames);
    core::parallel_for(subject.sequence.num_frames, [&](std::int64_t index) {
      const int frame = static_cast<int>(index);
      if (is_flow)
        make_flow(subject, frame, folder);
      else
        make_disparity(subject, frame, folder);
      progress.advance();
    });
  }
}

}  // namespace
}  // namespace terracast::validate

int main(int argc, char** argv) {
  using terracast::core::Error;
  terracast::core::settle_environment();
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (words.size() == 1 && (words[0] == "--help" || words[0] == "-h")) {
      fmt::print("{}", terracast::validate::kHelp);
      return 0;
    }
    terracast::validate::run(terracast::validate::parse(words));
    return 0;
  } catch (const Error& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return terracast::core::exit_status(error.kind());
  } catch (const std::exception& error) {  // of OpenCV, the file system, or memory
    fmt::print(stderr, "error: {}\n", error.what());
    return terracast::core::exit_status(terracast::core::ErrorKind::Io);
  }
}
