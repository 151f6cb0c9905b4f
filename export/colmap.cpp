// COLMAP model.
//
// World    east, north, up of WGS84 at the sequence's local origin; metres.
// Camera   RDF: x right, y down, z forward; pixel centres at +0.5, as ours; COLMAP's models.
// Pose     world to camera, quaternion w x y z. Each of our rigs is a rig of COLMAP's, its first
//          camera the reference, and has a frame at each instant; images.txt says the same poses
//          again for programs that know no rigs.
// Points   the capture's track points with every observation that a ray found free; POINTS2D are
//          their exact projections, so that the error is 0; by the cameras as they are, also where
//          the model states what is believed of them. The colour is the median over the
//          observations. Rolling shutters show a point where the line that sees it stands then: there
//          its observation is, off its projection by the image's one pose, and the error says by how much.
// database.db  cameras, images and their places on WGS84, for COLMAP's programs to start from.
// depth    ours: planar depth, float32, m; sky 0.

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/npy.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/colmap_model.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "colmap";
/// For forecasts: colours and the model, and depth.
constexpr double kBytesPerPixel = 1.7;
constexpr double kDepthBytesPerPixel = 4.0;
constexpr std::size_t kMinImages = 3;  // what COLMAP's own tools align and triangulate
/// The bound of the check colmap_points.
constexpr std::int64_t kPointsOfASequence = 2000;
constexpr std::int64_t kPointsOfAnImage = 50;
constexpr std::size_t kMinObservations = 2;  // of a point: one does not make a point
/// How far outside its image a point that the capture calls visible may project: rounding, not a
/// contradiction.
constexpr double kBorder_px = 1e-6;

using Color = std::array<std::uint8_t, 3>;

Color median_color(std::vector<Color> colors) {
  Color median{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto middle = colors.begin() + static_cast<std::ptrdiff_t>((colors.size() - 1) / 2);
    std::nth_element(colors.begin(), middle, colors.end(),
                     [k](const Color& a, const Color& b) { return a[k] < b[k]; });
    median[k] = (*middle)[k];
  }
  return median;
}

/// A sequence's model while it is being made. Image i of the model is frame i / cameras, camera i %
/// cameras.
class ModelBuilder {
 public:
  ModelBuilder(const capture::SequenceReader& sequence, const LocalFrame& local,
               const std::vector<ExportedCamera>& exported, const StatedCalibration& stated)
      : sequence_(sequence),
        world_(sequence.info().origin),
        local_(local),
        exported_(exported),
        stated_(stated.cameras(sequence.info())) {
    add_cameras();
    add_points();
    add_images();
  }

  const std::string& image_name(std::size_t image) const { return model_.images[image].name; }
  int frame_of(std::size_t image) const { return static_cast<int>(image / exported_.size()); }
  const ExportedCamera& camera_of(std::size_t image) const {
    return exported_[image % exported_.size()];
  }
  std::size_t num_images() const { return model_.images.size(); }

  /// Takes the colours of an image's observations. Threads: safe for different images.
  void sample(std::size_t image, const core::Image8& color) {
    for (const ColmapObservation& observation : model_.images[image].observations) {
      const auto at = [](double position, int size) {
        return std::clamp(static_cast<int>(std::floor(position)), 0, size - 1);
      };
      const int x = at(observation.pixel.x(), color.width());
      const int y = at(observation.pixel.y(), color.height());
      colors_[image].push_back({color(x, y, 0), color(x, y, 1), color(x, y, 2)});
    }
  }

  /// The model, once every image was sampled.
  const ColmapModel& finish() {
    for (ColmapPoint& point : model_.points) {
      point.error_px /= static_cast<double>(std::max<std::size_t>(point.track.size(), 1));
      std::vector<Color> colors;
      for (const auto& [image_id, index] : point.track)
        colors.push_back(colors_[image_id - 1][index]);
      point.color = median_color(std::move(colors));
    }
    return model_;
  }

 private:
  /// As the model states it.
  const capture::CameraCalibration& calibration(const ExportedCamera& camera) const {
    return stated_[static_cast<std::size_t>(camera.camera_index)];
  }

  void add_cameras() {
    for (std::size_t k = 0; k < exported_.size(); ++k) {
      const capture::CameraCalibration& camera = calibration(exported_[k]);
      const auto id = static_cast<std::uint32_t>(k + 1);
      model_.cameras.push_back({.id = id,
                                .folder = exported_[k].name,
                                .width_px = camera.intrinsics.width_px,
                                .height_px = camera.intrinsics.height_px,
                                .lens = colmap_lens(camera.intrinsics)});
      const auto [known, is_new] = rig_index_.emplace(camera.rig, model_.rigs.size());
      if (is_new) {
        model_.rigs.push_back({.id = static_cast<std::uint32_t>(model_.rigs.size() + 1),
                               .reference_camera_id = id,
                               .others = {}});
      } else {
        ColmapRig& rig = model_.rigs[known->second];
        const capture::CameraCalibration& reference =
            calibration(exported_[rig.reference_camera_id - 1]);
        rig.others.emplace_back(id, camera.rig_from_camera.inverse() * reference.rig_from_camera);
      }
    }
  }

  /// The points that at least two of the images see.
  void add_points() {
    std::map<std::int64_t, std::size_t> num_seen;
    for (const capture::FrameRecord& record : sequence_.frames())
      for (const ExportedCamera& camera : exported_)
        for (const std::int64_t id :
             record.cameras[static_cast<std::size_t>(camera.camera_index)].visible_tracks)
          ++num_seen[id];
    for (const capture::TrackPoint& track : sequence_.tracks()) {
      const auto found = num_seen.find(track.id);
      if (found == num_seen.end() || found->second < kMinObservations) continue;
      point_index_[track.id] = model_.points.size();
      model_.points.push_back({.id = model_.points.size() + 1,
                               .position = local_.local_from_world * track.point_world,
                               .color = {},
                               .track = {}});
    }
  }

  void add_images() {
    for (const capture::FrameRecord& record : sequence_.frames()) {
      const auto first_frame = model_.frames.size();
      for (const ColmapRig& rig : model_.rigs)
        model_.frames.push_back({.id = static_cast<std::uint32_t>(model_.frames.size() + 1),
                                 .rig_id = rig.id,
                                 .rig_from_world = {},
                                 .images = {}});
      for (const ExportedCamera& camera : exported_) {
        ColmapImage image;
        image.id = static_cast<std::uint32_t>(model_.images.size() + 1);
        image.camera_id = static_cast<std::uint32_t>(&camera - exported_.data() + 1);
        image.name = fmt::format("{}/{:06}.png", camera.name, record.index);
        image.camera_from_world =
            local_from_camera(local_, sequence_, record.index, calibration(camera)).inverse();
        image.place = world_.geodetic_from_world(
            sequence_.world_from_camera(record.index, camera.camera_index).translation);
        const std::size_t rig = rig_index_.at(calibration(camera).rig);
        ColmapFrame& frame = model_.frames[first_frame + rig];
        if (model_.rigs[rig].reference_camera_id == image.camera_id)
          frame.rig_from_world = image.camera_from_world;
        frame.images.emplace_back(image.camera_id, image.id);
        add_observations(record, camera, image);
        model_.images.push_back(std::move(image));
      }
    }
    colors_.resize(model_.images.size());
  }

  void add_observations(const capture::FrameRecord& record, const ExportedCamera& camera,
                        ColmapImage& image) {
    const auto model = geo::make_camera(
        sequence_.info().cameras[static_cast<std::size_t>(camera.camera_index)].intrinsics);
    const auto stated_model = geo::make_camera(calibration(camera).intrinsics);
    const capture::CameraView view = sequence_.view(*model, record.index, camera.camera_index);
    const geo::Rigid3d true_camera_from_local =
        local_from_camera(local_, sequence_, record.index, camera.camera_index).inverse();
    for (const std::int64_t id :
         record.cameras[static_cast<std::size_t>(camera.camera_index)].visible_tracks) {
      const auto found = point_index_.find(id);
      if (found == point_index_.end()) continue;
      ColmapPoint& point = model_.points[found->second];
      const std::optional<Eigen::Vector2d> pixel =
          view.motion ? seen_by_a_line(view, point)
                      : model->pixel_from_ray(true_camera_from_local * point.position);
      if (!pixel || !(pixel->x() >= -kBorder_px) || !(pixel->y() >= -kBorder_px) ||
          !(pixel->x() <= model->width_px() + kBorder_px) ||
          !(pixel->y() <= model->height_px() + kBorder_px))
        fail(ErrorKind::Input,
             "{}: frame {} says that {} sees the track point {}, which is outside its image; "
             "render the capture again",
             sequence_.folder().string(), record.index, camera.name, id);
      point.track.emplace_back(image.id, static_cast<std::uint32_t>(image.observations.size()));
      image.observations.push_back({*pixel, point.id});
      if (!view.motion) continue;
      const auto by_one_pose =
          stated_model->pixel_from_ray(image.camera_from_world * point.position);
      if (by_one_pose) point.error_px += (*by_one_pose - *pixel).norm();
    }
  }

  /// Where the image of a rolling shutter shows a point.
  std::optional<Eigen::Vector2d> seen_by_a_line(const capture::CameraView& view,
                                                const ColmapPoint& point) const {
    const auto seen = geo::find_seen(
        view.motion->shutter, view.model.width_px(), view.model.height_px(), [&](double offset_s) {
          const geo::Rigid3d local_from_camera =
              local_.local_from_world * view.motion->world_from_camera(offset_s);
          return view.model.pixel_from_ray(local_from_camera.inverse() * point.position);
        });
    if (!seen) return std::nullopt;
    return seen->pixel;
  }

  const capture::SequenceReader& sequence_;
  const geo::WorldFrame world_;
  const LocalFrame& local_;
  const std::vector<ExportedCamera>& exported_;
  const std::vector<capture::CameraCalibration>& stated_;
  ColmapModel model_;
  std::map<std::string, std::size_t> rig_index_;
  std::map<std::int64_t, std::size_t> point_index_;
  std::vector<std::vector<Color>> colors_;  ///< of each image's observations
};

class ColmapExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rigs", rigs_, "Rigs to export; none named: all.");
    visit.key("depth", has_depth_, "Write depth maps beside the model (ours, not COLMAP's).");
    calibration_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<ColmapExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return rigs_; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      core::with_context(
          [&] {
            const auto& calibration = cameras[static_cast<std::size_t>(camera.camera_index)];
            check_colmap_camera(calibration.intrinsics);
          },
          fmt::format("checking camera {} for {}", camera.name, kFormat));
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    return size_of_images(exported, kBytesPerPixel + (has_depth_ ? kDepthBytesPerPixel : 0.0));
  }

  /// Points are drawn from the images of all cameras alike; of those drawn from others' images nothing is
  /// expected. Of n that are drawn n p are its own, where p is its share of the cameras; five standard
  /// errors fewer must do: n p - 5 sqrt(n p (1 - p)) >= points wanted.
  TrackPointsWanted track_points_wanted(const std::vector<capture::CameraCalibration>& cameras,
                                        std::int64_t num_frames) const override {
    const auto num_exported = static_cast<std::int64_t>(cameras_taken(*this, cameras).size());
    const auto wanted = static_cast<double>(
        std::min(kPointsOfASequence, kPointsOfAnImage * num_frames * num_exported));
    const double share = static_cast<double>(num_exported) / static_cast<double>(cameras.size());
    const double spread = 5.0 * std::sqrt(1.0 - share);
    const double root = 0.5 * (spread + std::sqrt(spread * spread + 4.0 * wanted));
    return {.least = static_cast<std::int64_t>(wanted),
            .expected = static_cast<std::int64_t>(std::ceil(root * root / share * (1.0 - 1e-12)))};
  }

  std::int64_t least_images() const override { return kMinImages; }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    for (const capture::SequenceReader& sequence : sequences) {
      const std::size_t num_images =
          sequence.frames().size() * cameras_taken(*this, sequence.info().cameras).size();
      if (num_images < kMinImages)
        fail(ErrorKind::Input, "colmap: sequence {} has {} images; a model needs {} or more",
             sequence.info().name, num_images, kMinImages);
    }
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    core::Json list = core::Json::array();
    for (const capture::SequenceReader& sequence : sequences)
      list.push(write_sequence(sequence, writer, context));
    std::vector<std::string> additions;
    if (has_depth_)
      additions.emplace_back(
          "depth/RIG/CAMERA/NNNNNN.npy: planar depth, float32 (height, width), metres, sky 0");
    const bool has_lines = std::any_of(sequences.begin(), sequences.end(), [](const auto& each) {
      return each.info().has_rolling_shutter();
    });
    core::Json description = metadata(
        kFormat, "COLMAP 3.12 (rigs and frames), also text", hash, sequences,
        {{"pixel_center", "The centre of pixel i is at i + 0.5."},
         {"world_frame", "East, north, up of WGS84 at the sequence's origin; metres."},
         {"pose", "World to camera (x right, y down, z forward), quaternion w x y z."},
         {"points",
          std::string("Points of the surface; an observation stands where a ray found it free.") +
              (has_lines ? " In images of rolling shutters it stands where the line that sees the "
                           "point shows it, "
                           "off its projection by the image's one pose; a point's ERROR is the "
                           "mean distance of "
                           "the two, px."
                         : "")},
         {"priors",
          "database.db and georegistration.txt: latitude, longitude (degrees) and ellipsoidal "
          "height (metres) of the camera's centre, exact."},
         {"depth", "Along the optical axis, metres, float32."},
         {"sky", "Depth 0; no point."}},
        additions);
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  core::Json write_sequence(const capture::SequenceReader& sequence, DatasetWriter& writer,
                            const core::Context& context) const {
    const std::string& path = sequence.info().name;
    const std::vector<ExportedCamera> exported = cameras_taken(*this, sequence.info().cameras);
    const LocalFrame local = local_frame(sequence);
    ModelBuilder builder(sequence, local, exported, calibration_);
    const auto num_images = static_cast<std::int64_t>(builder.num_images());
    core::Progress progress(context, "images", num_images);
    core::parallel_for(num_images, [&](std::int64_t i) {
      write_image(sequence, static_cast<std::size_t>(i), path, builder, writer);
      progress.advance();
    });
    const ColmapModel& model = builder.finish();
    for (const ColmapFile& file : colmap_binary_files(model))
      writer.write(fmt::format("{}/sparse/0/{}", path, file.name), file.bytes);
    for (const ColmapFile& file : colmap_text_files(model))
      writer.write(fmt::format("{}/sparse_txt/0/{}", path, file.name), file.bytes);
    writer.write(path + "/database.db", colmap_database(model));
    writer.write(path + "/rig_config.json", colmap_rig_config(model));
    writer.write(path + "/georegistration.txt", colmap_georegistration(model));
    write_additions(writer, path, sequence, exported, scan_forms);

    std::size_t num_observations = 0;
    for (const ColmapPoint& point : model.points) num_observations += point.track.size();
    context.log.info("{}: {} images, {} points with {:.2f} observations each", path,
                     model.images.size(), model.points.size(),
                     static_cast<double>(num_observations) /
                         static_cast<double>(std::max<std::size_t>(model.points.size(), 1)));
    if (model.points.empty())
      context.log.warn("{}: no track point is seen twice; the model has no points", path);
    return describe_sequence(sequence, local, path, path, exported, calibration_);
  }

  void write_image(const capture::SequenceReader& sequence, std::size_t image,
                   const std::string& path, ModelBuilder& builder, DatasetWriter& writer) const {
    const int frame = builder.frame_of(image);
    const ExportedCamera& camera = builder.camera_of(image);
    const core::Image8 color =
        sequence.read_camera(frame, camera.camera_index, capture::SequenceReader::kColor).color;
    builder.sample(image, color);
    writer.write_kept(fmt::format("{}/images/{}", path, builder.image_name(image)),
                      [&] { return core::encode_png(color); });
    if (!has_depth_) return;
    writer.write_kept(fmt::format("{}/depth/{}/{:06}.npy", path, camera.name, frame), [&] {
      const auto model = geo::make_camera(
          sequence.info().cameras[static_cast<std::size_t>(camera.camera_index)].intrinsics);
      core::ImageF depth_m = capture::depth_image(
          *model, sequence.read_camera(frame, camera.camera_index, capture::SequenceReader::kFacts)
                      .range_m);
      for (float& value : depth_m.data())
        if (!std::isfinite(value)) value = 0.0F;
      return core::npy_bytes(depth_m);
    });
  }

  std::vector<std::string> rigs_;
  bool has_depth_ = true;
  StatedCalibration calibration_;
};

}  // namespace

ExporterInfo colmap_exporter() {
  return {.name = kFormat,
          .summary = "COLMAP: model with rigs, exact points and observations, text and binary.",
          .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<ColmapExporter>(); }};
}

}  // namespace terracast::exporters
