// Points through a sequence: where each of them is in every image, whether it is seen there, and what hides it. Points
// of what moves, and of what turns on it, are carried along.
//
// points.npz            what the points are: where they were drawn (a pixel's centre), of what they are, where they are
//                       in the world at each frame's time
// <rig>/<camera>.npz    where they are for that camera at each frame
// tracks.json           the cameras in their order, and what each array is; written last
// Each npz has a record beside it that says from what it was made.
//
// Of a rolling shutter a point's place in the image, its range and its sight are of the moment when its line is
// exposed; places in the world are of the frame's time.

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/log.h"
#include "core/npy.h"
#include "core/npz.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "labels/finished.h"
#include "labels/label.h"
#include "labels/label_index.h"
#include "labels/pair_cameras.h"
#include "labels/track_points.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// Arrays of points times frames take 100 bytes an element while a camera's are made.
constexpr std::int64_t kMostElements = 100'000'000;

/// What the arrays of the files are, as tracks.json has it.
struct ArrayNote {
  std::string_view name, type, shape, meaning;
};
constexpr ArrayNote kPointArrays[] = {
    {"points_world", "<f8", "N,T,3",
     "where the point is in the world at the frame's time, m; NaN: what it is of is not there"},
    {"is_present", "|b1", "N,T", "what it is of is there"},
    {"instance_id", "<u4", "N", "of what it is of; 0: the ground"},
    {"semantic_id", "<u4", "N", "its class"},
    {"body", "<i4", "N", "what it moves with: place in `moving` of sequence.json; -1: it stands"},
    {"query_frame", "<i4", "N", "frame of the image in which it was drawn"},
    {"query_camera", "<i4", "N", "camera of that image: place in `cameras`"},
    {"query_px", "<f8", "N,2", "where it is in that image, x and y: a pixel's centre"},
    {"time_s", "<f8", "T", "of the frames"},
};
constexpr ArrayNote kCameraArrays[] = {
    {"tracks_px", "<f8", "N,T,2",
     "where the point is, x and y, px, in the image or beside it; the centre of the first pixel is "
     "(0.5, 0.5); NaN: behind the camera, outside of its model, or not there"},
    {"visible", "|b1", "N,T", "it is in the image, and nothing hides it"},
    {"in_image", "|b1", "N,T", "it is within the image's borders"},
    {"occluder", "<u4", "N,T",
     "where it is in the image and hidden: the instance that hides it; 0: the ground"},
    {"range_m", "<f8", "N,T", "how far it is, m; NaN as tracks_px"},
};

/// Of all points and frames, point by point.
struct CameraTracks {
  CameraTracks(std::size_t num_points, std::size_t num_frames)
      : tracks_px(2 * num_points * num_frames, kNan),
        range_m(num_points * num_frames, kNan),
        is_visible(num_points * num_frames, 0),
        is_in_image(num_points * num_frames, 0),
        occluder(num_points * num_frames, 0) {}
  std::vector<double> tracks_px, range_m;
  std::vector<std::uint8_t> is_visible, is_in_image;
  std::vector<std::uint32_t> occluder;

  void put(std::size_t element, const Sighting& sighting) {
    tracks_px[2 * element] = sighting.pixel.x();
    tracks_px[2 * element + 1] = sighting.pixel.y();
    range_m[element] = sighting.range_m;
    is_visible[element] = sighting.is_visible ? 1 : 0;
    is_in_image[element] = sighting.is_in_image ? 1 : 0;
    occluder[element] = sighting.occluder_id;
  }
};

/// Takes what it is made of, so that it is not in memory twice.
std::vector<std::byte> npz_of(CameraTracks tracks, int num_points, int num_frames) {
  const auto taken = [](auto& values) { return std::exchange(values, {}); };
  std::vector<core::NpzArray> arrays;
  arrays.push_back(
      {"tracks_px", core::npy_bytes(taken(tracks.tracks_px), {num_points, num_frames, 2})});
  arrays.push_back(
      {"visible", core::npy_bool_bytes(taken(tracks.is_visible), {num_points, num_frames}), true});
  arrays.push_back({"in_image",
                    core::npy_bool_bytes(taken(tracks.is_in_image), {num_points, num_frames}),
                    true});
  arrays.push_back(
      {"occluder", core::npy_bytes(taken(tracks.occluder), {num_points, num_frames}), true});
  arrays.push_back({"range_m", core::npy_bytes(taken(tracks.range_m), {num_points, num_frames})});
  return core::npz_bytes(arrays);
}

std::vector<ShownPoint> shown_points(const std::vector<TrackedPoint>& tracked) {
  std::vector<ShownPoint> points;
  for (const TrackedPoint& one : tracked) points.push_back(one.point);
  return points;
}

CameraTracks tracks_of(const Matcher& matcher, const std::vector<TrackedPoint>& tracked, int camera,
                       std::size_t num_frames, core::Progress& progress) {
  const std::vector<ShownPoint> points = shown_points(tracked);
  CameraTracks tracks(points.size(), num_frames);
  constexpr int kAhead = 32;  // frames, in order: their tiles are those of a stretch of the way
  core::parallel_in_order(
      static_cast<std::int64_t>(num_frames), kAhead,
      [&](std::int64_t frame) {
        const auto sightings = matcher.follow(points, {static_cast<int>(frame), camera});
        for (std::size_t i = 0; i < sightings.size(); ++i)
          if (sightings[i])
            tracks.put(i * num_frames + static_cast<std::size_t>(frame), *sightings[i]);
      },
      [&](std::int64_t) { progress.advance(); });
  return tracks;
}

/// points.npz.
/// cameras   of the sequence that are followed, in their order
std::vector<std::byte> npz_of_points(const capture::SequenceReader& sequence,
                                     const Matcher& matcher,
                                     const std::vector<TrackedPoint>& tracked,
                                     const std::vector<int>& cameras) {
  const std::vector<capture::FrameRecord>& frames = sequence.frames();
  std::vector<double> places_world(3 * tracked.size() * frames.size(), kNan);
  std::vector<std::uint8_t> is_present(tracked.size() * frames.size(), 0);
  std::vector<std::uint32_t> instance_id, semantic_id;
  std::vector<std::int32_t> body, query_frame, query_camera;
  std::vector<double> query_px, time_s;
  for (const TrackedPoint& one : tracked) {
    const std::size_t first = instance_id.size() * frames.size();
    for (std::size_t frame = 0; frame < frames.size(); ++frame)
      if (const auto place_world = matcher.place(one.point, static_cast<int>(frame))) {
        is_present[first + frame] = 1;
        std::copy_n(place_world->data(), 3, &places_world[3 * (first + frame)]);
      }
    instance_id.push_back(one.instance_id);
    semantic_id.push_back(one.semantic_id);
    body.push_back(one.point.body ? static_cast<std::int32_t>(*one.point.body) : -1);
    query_frame.push_back(one.image.frame);
    query_camera.push_back(static_cast<std::int32_t>(
        std::find(cameras.begin(), cameras.end(), one.image.camera) - cameras.begin()));
    const Eigen::Vector2d center = capture::pixel_center(one.pixel.x(), one.pixel.y());
    query_px.insert(query_px.end(), {center.x(), center.y()});
  }
  for (const capture::FrameRecord& frame : frames) time_s.push_back(frame.time_s);
  const auto n = static_cast<int>(tracked.size());
  const auto t = static_cast<int>(frames.size());
  return core::npz_bytes({{"points_world", core::npy_bytes(places_world, {n, t, 3}), true},
                          {"is_present", core::npy_bool_bytes(is_present, {n, t}), true},
                          {"instance_id", core::npy_bytes(instance_id, {n})},
                          {"semantic_id", core::npy_bytes(semantic_id, {n})},
                          {"body", core::npy_bytes(body, {n})},
                          {"query_frame", core::npy_bytes(query_frame, {n})},
                          {"query_camera", core::npy_bytes(query_camera, {n})},
                          {"query_px", core::npy_bytes(query_px, {n, 2})},
                          {"time_s", core::npy_bytes(time_s, {t})}});
}

Json json_of_notes(std::span<const ArrayNote> notes) {
  Json arrays = Json::array();
  for (const ArrayNote& note : notes)
    arrays.push(Json::object()
                    .set("name", note.name)
                    .set("type", note.type)
                    .set("shape", note.shape)
                    .set("meaning", note.meaning));
  return arrays;
}

class TracksLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("num_points", num_points_,
              "Points of a sequence, all its cameras together: they are drawn from its images, all "
              "frames and cameras in turn, and each is followed in all of them.",
              core::between(1, 1000000));
    visit.key("moving_share", moving_share_,
              "Share of them on what moves, where that much of it is seen; the others are on what "
              "stands.",
              core::between(0.0, 1.0));
    visit.key("cameras", cameras_,
              "Cameras, each as \"RIG/NAME\", from whose images points are drawn and in which they "
              "are followed. Empty: all.");
    visit.key("seed", seed_, "Another seed is other points.", core::between(0, 9e15));
  }
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<TracksLabel>(*this);
  }

  void check(std::span<const SequenceOutline> sequences, const core::Log& log) const override {
    check_cameras(sequences);
    for (const SequenceOutline& sequence : sequences) {
      if (num_points_ * sequence.num_frames > kMostElements)
        fail(ErrorKind::Config,
             "tracks: {} points through the {} frames of sequence {} would take {:.0f} GB of "
             "memory; num_points = {} is the most for it",
             num_points_, sequence.num_frames, sequence.name,
             100e-9 * static_cast<double>(num_points_ * sequence.num_frames),
             kMostElements / sequence.num_frames);
      if (cameras_of(sequence.cameras).empty())
        log.warn("tracks: sequence {} has none of the cameras, and so no tracks", sequence.name);
    }
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const Work work(inputs, cameras_of(inputs.sequence.info().cameras), wanted(inputs.sequence));
    if (work.cameras.empty()) return {};
    if (work.missing().empty())
      inputs.context.log.info("{}: its tracks are there already", inputs.sequence.info().name);
    else
      make_missing(inputs, work);
    index_of(inputs.sequence, work).write(work.folder / "tracks.json");
    LabelFiles files = {"tracks.json"};
    for (const std::string& stem : work.stems())
      files.insert({fs::path(stem + ".npz"), fs::path(stem + ".json")});
    return files;
  }

 private:
  /// What is to be made of a sequence.
  struct Work {
    Work(const LabelInputs& inputs, std::vector<int> its_cameras, Json its_record)
        : sequence(inputs.sequence),
          folder(inputs.sequence.folder() / capture::kLabelsFolder / "tracks"),
          cameras(std::move(its_cameras)),
          record(std::move(its_record)) {}
    const capture::SequenceReader& sequence;
    fs::path folder;
    std::vector<int> cameras;
    Json record;  ///< what the record of each file says

    std::string stem_of(int camera) const {
      return camera_name(sequence.info().cameras[static_cast<std::size_t>(camera)]);
    }
    /// Of all files of arrays.
    std::vector<std::string> stems() const {
      std::vector<std::string> all = {"points"};
      for (const int camera : cameras) all.push_back(stem_of(camera));
      return all;
    }
    bool is_finished(const std::string& stem) const {
      return is_label_finished(folder / (stem + ".json"), folder / (stem + ".npz"), record);
    }
    std::set<std::string> missing() const {
      std::set<std::string> some;
      for (const std::string& stem : stems())
        if (!is_finished(stem)) some.insert(stem);
      return some;
    }
    void write(const std::string& stem, std::size_t num_points,
               const std::vector<std::byte>& npz) const {
      core::write_file(folder / (stem + ".npz"), npz);
      Json of_file = record;
      of_file.set("points", static_cast<std::int64_t>(num_points))
          .set("xxh3_128", core::content_hash(npz));
      of_file.write(folder / (stem + ".json"));
    }
  };

  /// The places of the cameras that are asked for among those of a sequence, ascending.
  std::vector<int> cameras_of(const std::vector<capture::CameraCalibration>& all) const {
    std::vector<int> places;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (cameras_.empty() ||
          std::find(cameras_.begin(), cameras_.end(), camera_name(all[i])) != cameras_.end())
        places.push_back(static_cast<int>(i));
    return places;
  }

  /// throws   Config: one that no sequence has
  void check_cameras(std::span<const SequenceOutline> sequences) const {
    if (sequences.empty()) return;
    const std::vector<capture::CameraCalibration> all = cameras_of_all(sequences);
    for (const std::string& name : cameras_) find_camera(all, name);
  }

  Json wanted(const capture::SequenceReader& sequence) const {
    std::vector<std::string> cameras;
    for (const int camera : cameras_of(sequence.info().cameras))
      cameras.push_back(camera_name(sequence.info().cameras[static_cast<std::size_t>(camera)]));
    return Json::object()
        .set("format", "terracast tracks")
        .set("version", 1)
        .set("capture", capture::labels_source(sequence))
        .set("num_points", num_points_)
        .set("moving_share", moving_share_)
        .set("seed", seed_)
        .set("cameras", Json::array_of(cameras));
  }

  void make_missing(const LabelInputs& inputs, const Work& work) const {
    remove_index(work.folder / "tracks.json");
    const capture::SequenceReader& sequence = inputs.sequence;
    const Matcher matcher(sequence, inputs.store, inputs.moving);
    inputs.context.log.info("{}: draws {} points from {} images", sequence.info().name, num_points_,
                            work.cameras.size() * sequence.frames().size());
    const std::vector<TrackedPoint> points =
        draw_tracks(sequence, matcher,
                    {.num_points = num_points_,
                     .moving_share = moving_share_,
                     .seed = static_cast<std::uint64_t>(seed_)},
                    work.cameras);
    tell(points, sequence, inputs.context.log);
    const std::set<std::string> missing = work.missing();
    if (missing.contains("points"))
      work.write("points", points.size(), npz_of_points(sequence, matcher, points, work.cameras));
    const std::size_t num_frames = sequence.frames().size();
    core::Progress progress(inputs.context, "images",
                            static_cast<std::int64_t>(work.cameras.size() * num_frames));
    for (const int camera : work.cameras) {
      if (!missing.contains(work.stem_of(camera))) {
        progress.skip(static_cast<std::int64_t>(num_frames));
        continue;
      }
      work.write(work.stem_of(camera), points.size(),
                 npz_of(tracks_of(matcher, points, camera, num_frames, progress),
                        static_cast<int>(points.size()), static_cast<int>(num_frames)));
    }
  }

  void tell(const std::vector<TrackedPoint>& points, const capture::SequenceReader& sequence,
            const core::Log& log) const {
    const auto num_moving = std::count_if(
        points.begin(), points.end(), [](const auto& one) { return one.point.body.has_value(); });
    log.info("{}: follows {} points, {} of them on what moves", sequence.info().name, points.size(),
             num_moving);
    if (points.empty())
      log.warn("{}: its images show nothing to follow: its tracks are empty", sequence.info().name);
    else if (static_cast<std::int64_t>(points.size()) < num_points_)
      log.warn("{}: its images show {} points of {} that are asked for", sequence.info().name,
               points.size(), num_points_);
  }

  static Json index_of(const capture::SequenceReader& sequence, const Work& work) {
    Json files = Json::array();
    for (const int camera : work.cameras) files.push(work.stem_of(camera) + ".npz");
    const std::int64_t num_points = Json::read(work.folder / "points.json").at("points").integer();
    Json index = work.record;
    index.set("points", num_points)
        .set("frames", static_cast<std::int64_t>(sequence.frames().size()))
        .set("points_file", "points.npz")
        .set("camera_files", std::move(files))
        .set("points_arrays", json_of_notes(kPointArrays))
        .set("camera_arrays", json_of_notes(kCameraArrays));
    return index;
  }

  std::int64_t num_points_ = 2048;
  double moving_share_ = 0.25;
  std::vector<std::string> cameras_;
  std::int64_t seed_ = 1;
};

}  // namespace

LabelInfo tracks_label() {
  return {.name = "tracks",
          .summary =
              "Points on what stands and what moves through all images of a sequence: where each "
              "is, whether it is seen, and what hides it.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<TracksLabel>(); }};
}

}  // namespace terracast::labels
