// terracast's own format: every camera model, all rigs, global and rolling shutters, and what moves.
//
// Rays       rays.npy: the unit direction of each pixel's ray in the camera's frame (x right, y down, z forward);
//            origins.npy, of cameras whose rays have no one centre, where it starts. So nobody needs the models.
// Range      along the ray, m, float32, as it was traced: to the bit the capture's. +inf sky, NaN no ray.
// Poses      poses.csv: local_from_camera, local being east, north, up of WGS84 at the sequence's origin.
// Flow       from a pixel's centre to where the next or the previous image shows the point; NaN where it does not.
//            Mask: bit 0 the point lands in the image, bit 1 and is seen there.
// Pixels     centres at i + 0.5.

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/npy.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/registry.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/motion_record.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr const char* kFormat = "terracast";
constexpr int kCamerasVersion = 1;

/// What may be written of an image, and about how many bytes a pixel that takes, for forecasts.
struct Modality {
  const char* name;
  double bytes_per_px;
};
constexpr Modality kModalities[] = {{"image", 1.6},    {"range", 4.0},   {"class", 0.1},
                                    {"instance", 4.0}, {"normal", 12.0}, {"flow", 16.2}};

std::vector<std::string> modality_names() {
  std::vector<std::string> names;
  for (const Modality& modality : kModalities) names.emplace_back(modality.name);
  return names;
}

/// Vectors of all pixels, row by row, as an array (height, width, 3) of doubles.
template <class VectorOf>
std::vector<std::byte> vectors_npy(const geo::CameraModel& model, const VectorOf& vector_of) {
  std::vector<double> values;
  values.reserve(3 * static_cast<std::size_t>(model.width_px()) *
                 static_cast<std::size_t>(model.height_px()));
  for (int y = 0; y < model.height_px(); ++y)
    for (int x = 0; x < model.width_px(); ++x) {
      const Vector3d vector = vector_of(capture::pixel_center(x, y));
      values.insert(values.end(), {vector.x(), vector.y(), vector.z()});
    }
  return core::npy_bytes(values, {model.height_px(), model.width_px(), 3});
}

/// NaN where no ray comes in.
Vector3d unit_ray(const geo::CameraModel& model, const Vector2d& pixel) {
  return model.ray_from_pixel(pixel).normalized();
}

Json camera_entry(const std::string& name, const capture::CameraCalibration& camera) {
  const geo::CameraIntrinsics& k = camera.intrinsics;
  const geo::CameraModelInfo& info =
      core::find_registered(geo::camera_models(), "camera model", k.model);
  const bool is_central = geo::make_camera(k)->is_central();
  const geo::Rigid3d pose = camera.body_from_camera();
  const Eigen::Quaterniond q = canonical(pose.rotation);
  const Vector3d& t = pose.translation;
  Json entry = Json::object()
                   .set("name", name)
                   .set("rig", camera.rig)
                   .set("camera", camera.name)
                   .set("width_px", k.width_px)
                   .set("height_px", k.height_px)
                   .set("model", k.model)
                   .set("parameter_names", info.parameter_names())
                   .set("parameters", Json::array_of(k.parameters))
                   .set("body_from_camera",
                        Json::object()
                            .set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
                            .set("translation_m", Json::array_of({t.x(), t.y(), t.z()})))
                   .set("shutter", describe_shutter(camera.shutter))
                   .set("rays", name + "/rays.npy");
  if (!is_central) entry.set("origins", name + "/origins.npy");
  return entry;
}

std::string classes_text() {
  Json classes = Json::object();
  for (std::size_t i = 0; i < capture::semantic_class_names().size(); ++i)
    classes.set(capture::semantic_class_names()[i], static_cast<int>(i));
  return Json::object().set("classes", std::move(classes)).text() + "\n";
}

core::Image8 class_image(const core::ImageU32& semantic_id) {
  core::Image8 classes(semantic_id.width(), semantic_id.height());
  std::transform(semantic_id.data().begin(), semantic_id.data().end(), classes.data().begin(),
                 [](std::uint32_t id) { return static_cast<std::uint8_t>(id); });
  return classes;
}

/// Normals in the local frame; NaN where no surface is.
core::ImageF local_normals(const LocalFrame& local, const capture::CameraFrame& facts) {
  const Eigen::Matrix3d local_from_world = local.local_from_world.rotation.toRotationMatrix();
  core::ImageF normals(facts.range_m.width(), facts.range_m.height(), 3,
                       std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < normals.height(); ++y)
    for (int x = 0; x < normals.width(); ++x) {
      if (!std::isfinite(facts.range_m(x, y))) continue;
      const Vector3d world(static_cast<double>(facts.normal_world(x, y, 0)),
                           static_cast<double>(facts.normal_world(x, y, 1)),
                           static_cast<double>(facts.normal_world(x, y, 2)));
      const Vector3d normal = (local_from_world * world).normalized();
      for (int c = 0; c < 3; ++c) normals(x, y, c) = static_cast<float>(normal[c]);
    }
  return normals;
}

/// An image of the capture, for one thread.
struct Shot {
  const capture::SequenceReader& sequence;
  const geo::CameraModel& model;
  int frame = 0;
  int camera_index = 0;
  std::optional<capture::CameraFrame> read_facts = {};

  /// Read when they are first asked for, and kept.
  const capture::CameraFrame& facts() {
    if (!read_facts)
      read_facts = sequence.read_camera(frame, camera_index, capture::SequenceReader::kFacts);
    return *read_facts;
  }
};

/// Flow from one frame to another, with its mask.
struct MaskedFlow {
  core::ImageF motion_px;  ///< NaN where the other image's camera does not see the point
  core::Image8 mask;
};
MaskedFlow flow_to(int to, Shot& shot) {
  const capture::SequenceReader& sequence = shot.sequence;
  const geo::CameraModel& model = shot.model;
  const int from = shot.frame;
  const auto record = [&](int frame) -> const capture::FrameRecord& {
    return sequence.frames()[static_cast<std::size_t>(frame)];
  };
  const capture::CameraFrame& facts = shot.facts();
  const std::uint32_t visible = to > from ? capture::kVisibleNext : capture::kVisiblePrevious;
  MaskedFlow flow;
  flow.motion_px = capture::flow_image(sequence.view(model, from, shot.camera_index),
                                       sequence.view(model, to, shot.camera_index),
                                       {sequence.info(), record(from), record(to)}, facts);
  flow.mask = core::Image8(facts.range_m.width(), facts.range_m.height());
  for (int y = 0; y < flow.mask.height(); ++y)
    for (int x = 0; x < flow.mask.width(); ++x) {
      const Vector2d motion(static_cast<double>(flow.motion_px(x, y, 0)),
                            static_cast<double>(flow.motion_px(x, y, 1)));
      if (!motion.allFinite()) continue;
      const bool is_seen = (facts.flags(x, y) & visible) != 0 && std::isfinite(facts.range_m(x, y));
      // A point that is seen is in view, even where a float's rounding puts it on the border.
      const bool is_in_view = is_seen || model.contains(capture::pixel_center(x, y) + motion);
      flow.mask(x, y) = is_seen ? 3 : is_in_view ? 1 : 0;
    }
  return flow;
}

class TerracastExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rigs", rigs_, "Rigs to export; none named: all.");
    visit.key("modalities", modalities_,
              "What is written of every image: image, range, class, instance, normal, flow.");
    calibration_.describe(visit);
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<TerracastExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return rigs_; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    check_provable(*this, cameras);
    const std::vector<std::string> known = modality_names();
    for (const std::string& name : modalities_)
      if (std::find(known.begin(), known.end(), name) == known.end())
        fail(ErrorKind::Config, "terracast: {}",
             core::unknown_name_message("modality", name, known));
    if (modalities_.empty())
      fail(ErrorKind::Config, "terracast: modalities = []: one or more of {} are right",
           fmt::join(known, ", "));
  }

  std::uint32_t flags() const override {
    const std::uint32_t of_flow =
        holds("flow") ? capture::kVisibleNext | capture::kVisiblePrevious : 0U;
    return capture::kEdge | of_flow;
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    std::vector<const capture::CameraCalibration*> exported;
    for (const ExportedCamera& camera : cameras_taken(*this, cameras))
      exported.push_back(&cameras[static_cast<std::size_t>(camera.camera_index)]);
    double bytes_per_px = 0.0;
    for (const Modality& modality : kModalities)
      if (holds(modality.name)) bytes_per_px += modality.bytes_per_px;
    return size_of_images(exported, bytes_per_px);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    writer.write("classes.json", classes_text());
    Json list = Json::array();
    for (const capture::SequenceReader& sequence : sequences)
      list.push(write_sequence(sequence, writer, context));
    Json description = metadata(kFormat, "1", hash, sequences, conventions(), {});
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  static std::vector<std::pair<std::string, std::string>> conventions() {
    return {
        {"pixel_center", "The centre of pixel i is at i + 0.5."},
        {"world_frame", "East, north, up of WGS84 at the sequence's origin; metres."},
        {"pose",
         "poses.csv: camera (x right, y down, z forward) to that frame, quaternion w x y z."},
        {"rays",
         "rays.npy: unit direction of the ray through each pixel's centre, camera frame; NaN "
         "where none comes in. It starts at the camera's place, or at origins.npy, m, camera "
         "frame."},
        {"depth",
         "range: metres along the ray, float32, NaN where no ray comes in; depth along the optical "
         "axis is it times the ray's z."},
        {"sky", "+inf in range."},
        {"class", "Number of classes.json."},
        {"instance", "32 bits; 0 the ground, sky, and where no ray comes in."},
        {"normal", "Of the surface, unit, in the frame of the poses; NaN where there is none."},
        {"flow",
         "Pixels, (u, v), to where the next (flow_forward) or the previous (flow_backward) image "
         "shows the point; sky by rotation alone; NaN where that image's camera does not see it. "
         "Mask: 0 not in its image, 1 in it, 3 in it and seen, by a ray."}};
  }

  bool holds(const char* modality) const {
    return std::find(modalities_.begin(), modalities_.end(), modality) != modalities_.end();
  }

  Json write_sequence(const capture::SequenceReader& sequence, DatasetWriter& writer,
                      const core::Context& context) const {
    const std::string& path = sequence.info().name;
    const std::vector<ExportedCamera> exported = cameras_taken(*this, sequence.info().cameras);
    const LocalFrame local = local_frame(sequence);
    write_cameras(sequence, exported, path, writer);
    writer.write(path + "/poses.csv", poses_csv(sequence, exported, local));
    write_additions(writer, path, sequence, exported, scan_forms);

    std::vector<std::unique_ptr<geo::CameraModel>> models;
    for (const ExportedCamera& camera : exported)
      models.push_back(geo::make_camera(
          sequence.info().cameras[static_cast<std::size_t>(camera.camera_index)].intrinsics));
    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    const auto num_cameras = static_cast<std::int64_t>(exported.size());
    core::Progress progress(context, "images", num_frames * num_cameras);
    core::parallel_for(num_frames * num_cameras, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i / num_cameras);
      const auto index = static_cast<std::size_t>(i % num_cameras);
      const std::string folder = path + "/" + exported[index].name;
      Shot shot{sequence, *models[index], frame, exported[index].camera_index};
      write_image(local, folder, shot, writer);
      if (holds("flow")) write_flow(folder, shot, writer);
      progress.advance();
    });
    return describe_sequence(sequence, local, path, path, exported, calibration_);
  }

  /// cameras.json and the tables of rays.
  void write_cameras(const capture::SequenceReader& sequence,
                     const std::vector<ExportedCamera>& exported, const std::string& path,
                     DatasetWriter& writer) const {
    const auto& cameras = calibration_.cameras(sequence.info());
    Json list = Json::array();
    for (const ExportedCamera& each : exported) {
      const capture::CameraCalibration& camera =
          cameras[static_cast<std::size_t>(each.camera_index)];
      list.push(camera_entry(each.name, camera));
      const std::string folder = path + "/" + each.name;
      const auto model = geo::make_camera(camera.intrinsics);
      writer.write_kept(folder + "/rays.npy", [&] {
        return vectors_npy(*model, [&](const Vector2d& pixel) { return unit_ray(*model, pixel); });
      });
      if (model->is_central()) continue;
      writer.write_kept(folder + "/origins.npy", [&] {
        return vectors_npy(*model,
                           [&](const Vector2d& pixel) { return model->origin_from_pixel(pixel); });
      });
    }
    writer.write(path + "/cameras.json", Json::object()
                                                 .set("format", "terracast-cameras")
                                                 .set("version", kCamerasVersion)
                                                 .set("cameras", std::move(list))
                                                 .text() +
                                             "\n");
  }

  std::string poses_csv(const capture::SequenceReader& sequence,
                        const std::vector<ExportedCamera>& exported,
                        const LocalFrame& local) const {
    const auto& cameras = calibration_.cameras(sequence.info());
    std::string text = "frame,camera,time_s,x_m,y_m,z_m,qw,qx,qy,qz\n";
    for (const capture::FrameRecord& record : sequence.frames())
      for (const ExportedCamera& each : exported) {
        const geo::Rigid3d pose = local_from_camera(
            local, sequence, record.index, cameras[static_cast<std::size_t>(each.camera_index)]);
        const Eigen::Quaterniond q = canonical(pose.rotation);
        const Vector3d& t = pose.translation;
        text += fmt::format(
            "{},{},{:.9f},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", record.index,
            each.name, record.time_s, t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
      }
    return text;
  }

  void write_image(const LocalFrame& local, const std::string& folder, Shot& shot,
                   DatasetWriter& writer) const {
    const auto file = [&](const char* kind, const char* suffix) {
      return fmt::format("{}/{}/{:06}{}", folder, kind, shot.frame, suffix);
    };
    if (holds("image"))
      writer.write_kept(file("image", ".png"), [&] {
        return core::encode_png(
            shot.sequence
                .read_camera(shot.frame, shot.camera_index, capture::SequenceReader::kColor)
                .color);
      });
    const std::vector<std::pair<const char*, std::string>> of_facts = {
        {"range", file("range", ".npy")},
        {"class", file("class", ".png")},
        {"instance", file("instance", ".npy")},
        {"normal", file("normal", ".npy")}};
    std::vector<std::pair<std::string_view, std::string>> missing;
    for (const auto& [modality, path] : of_facts)
      if (holds(modality) && !writer.keep(path)) missing.emplace_back(modality, path);
    if (missing.empty()) return;
    const capture::CameraFrame& facts = shot.facts();
    for (const auto& [modality, path] : missing) {
      if (modality == "range") writer.write(path, core::npy_bytes(facts.range_m));
      if (modality == "class") writer.write(path, core::encode_png(class_image(facts.semantic_id)));
      if (modality == "instance") writer.write(path, core::npy_bytes(facts.instance_id));
      if (modality == "normal") writer.write(path, core::npy_bytes(local_normals(local, facts)));
    }
  }

  static void write_flow(const std::string& folder, Shot& shot, DatasetWriter& writer) {
    const auto num_frames = static_cast<int>(shot.sequence.frames().size());
    const int frame = shot.frame;
    for (const int to : {frame + 1, frame - 1}) {
      if (to < 0 || to >= num_frames) continue;
      const std::string stem =
          fmt::format("{}/{}/{:06}", folder, to > frame ? "flow_forward" : "flow_backward", frame);
      const bool has_flow = writer.keep(stem + ".npy");
      const bool has_mask = writer.keep(stem + "_mask.png");
      if (has_flow && has_mask) continue;
      const MaskedFlow flow = flow_to(to, shot);
      if (!has_flow) writer.write(stem + ".npy", core::npy_bytes(flow.motion_px));
      if (!has_mask) writer.write(stem + "_mask.png", core::encode_png(flow.mask));
    }
  }

  std::vector<std::string> rigs_;
  std::vector<std::string> modalities_ = modality_names();
  StatedCalibration calibration_;
};

}  // namespace

ExporterInfo terracast_exporter() {
  return {
      .name = kFormat,
      .summary = "Every camera model, with tables of rays; range, classes, normals, flow, poses.",
      .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<TerracastExporter>(); }};
}

}  // namespace terracast::exporters
