#include "broken/kinds.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "core/hash.h"
#include "export/dataset_writer.h"
#include "tiler/surface.h"

/// Kinds that are each wrong in one way, which their names say.
namespace broken {
namespace {

using namespace terracast;
using Eigen::Vector2d;
using Eigen::Vector3d;

class Sensor : public sensors::Sensor {
 public:
  void describe(core::SchemaVisitor&) override {}
  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "value", .unit = "m"}};
  }
};

struct ThrowingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<ThrowingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double> times_s,
               std::span<double>) const override {
    static_cast<void>(std::vector<int>().at(times_s.size()));
  }
};

struct HangingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<HangingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {
    while (true) std::this_thread::sleep_for(std::chrono::seconds(1));
  }
};

struct NanSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<NanSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double> times_s,
               std::span<double> values) const override {
    for (std::size_t i = 0; i < times_s.size(); ++i)
      values[i] = std::sqrt(times_s[i] - 0.5);
  }
};

/// Each sample depends on how many are measured with it.
struct CountingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<CountingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double> times_s,
               std::span<double> values) const override {
    for (std::size_t i = 0; i < times_s.size(); ++i)
      values[i] = static_cast<double>(times_s.size());
  }
};

struct CrashingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<CrashingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double> values) const override {
    volatile double* nowhere = nullptr;
    *nowhere = 1.0;
    values[0] = *nowhere;
  }
};

/// Ends the process as if all were well.
struct LeavingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<LeavingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {
    std::_Exit(0);
  }
};

/// The same by the function that runs what is registered for the end.
struct ExitingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<ExitingSensor>(*this);
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {
    std::quick_exit(0);
  }
};

/// Its channel's name would break the tables that it heads.
struct NamelessSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<NamelessSensor>(*this);
  }
  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "height, m\n", .unit = "m"}};
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {}
};

/// Has a key that every sensor has.
struct ShadowingSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<ShadowingSensor>(*this);
  }
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rate_hz", rate_hz_, "Another rate.");
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {}
  double rate_hz_ = 1.0;
};

struct UncopiedSensor : Sensor {
  std::unique_ptr<sensors::Sensor> clone() const override { return nullptr; }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double>) const override {}
};

template <class Kind>
sensors::SensorInfo sensor_row(const char* name) {
  return {.name = name, .summary = name, .make = [] {
            return std::unique_ptr<sensors::Sensor>(std::make_unique<Kind>());
          }};
}

/// A pinhole whose image points come back a thousandth of a pixel aside.
class ShiftedCamera : public geo::CameraModel {
 public:
  explicit ShiftedCamera(const geo::CameraIntrinsics& intrinsics) : CameraModel(intrinsics) {}
  Vector3d ray_from_pixel(const Vector2d& pixel) const override {
    const std::vector<double>& p = intrinsics().parameters;
    return {(pixel.x() - p[2]) / p[0], (pixel.y() - p[3]) / p[1], 1.0};
  }
  std::optional<Vector2d> pixel_from_ray(const Vector3d& ray) const override {
    if (!(ray.z() > 0.0) || !ray.allFinite()) return std::nullopt;
    const std::vector<double>& p = intrinsics().parameters;
    return Vector2d(p[0] * ray.x() / ray.z() + p[2] + 1e-3, p[1] * ray.y() / ray.z() + p[3]);
  }
  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Vector3d&) const override {
    return Eigen::Matrix<double, 2, 3>::Zero();
  }
  double finest_pixels_per_radian() const override { return 1.0; }
};

/// Light comes through in a share above 1, farther than 1 km.
struct BrighteningMedium : scene::MediumOptions {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<MediumOptions> clone() const override {
    return std::make_unique<BrighteningMedium>(*this);
  }
  std::unique_ptr<scene::Medium> make(const scene::MediumSite&) const override {
    struct Brightening : scene::Medium {
      double sun_transmittance(const Vector3d&) const override { return 1.0; }
      scene::SeenMedium look(const scene::MediumRay& ray) const override {
        return {.transmittance = scene::Color::Constant(ray.until_m > 1e3 ? 1.5f : 1.0f),
                .radiance = scene::Color::Zero(),
                .distance_m = 0.0};
      }
    };
    return std::make_unique<Brightening>();
  }
};

/// Its options are there, and make no medium.
struct AbsentMedium : scene::MediumOptions {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<MediumOptions> clone() const override {
    return std::make_unique<AbsentMedium>(*this);
  }
  std::unique_ptr<scene::Medium> make(const scene::MediumSite&) const override { return nullptr; }
};

/// Raises the ground by how often it has been asked.
struct CountingLayer : tiler::LayerKind {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<LayerKind> clone() const override {
    return std::make_unique<CountingLayer>(*this);
  }
  std::unique_ptr<tiler::Layer> make(const tiler::LayerInputs&) const override {
    struct Counting : tiler::Layer {
      world::LayerInfo info() const override {
        world::LayerInfo info;
        info.source = "procedural";
        info.content_hash = input_hash();
        return info;
      }
      std::string input_hash() const override { return core::content_hash("counting"); }
      double lift_m(const Vector2d&, const tiler::SurfaceSample&) const override {
        return 1e-3 * static_cast<double>(++num_asked_ % 4096);
      }
      mutable std::atomic<std::uint64_t> num_asked_{0};
    };
    return std::make_unique<Counting>();
  }
};

/// Writes down when it was written.
class DatedExporter : public exporters::Exporter {
 public:
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<DatedExporter>(*this);
  }
  std::vector<std::string> rigs() const override { return {}; }
  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    if (cameras.empty()) core::fail(core::ErrorKind::Config, "no camera");
  }
  exporters::FrameSize frame_size(const std::vector<capture::CameraCalibration>&) const override {
    return {};
  }
  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::string hash = exporters::source_hash("broken.dated", *this, sequences);
    exporters::DatasetWriter writer(folder, "broken.dated", hash, context);
    if (writer.is_complete()) return;
    const auto now = std::chrono::system_clock::now().time_since_epoch().count();
    writer.write("when.txt", std::string_view(std::to_string(now)));
    writer.finish(exporters::metadata("broken.dated", "1", hash, sequences, {}, {}));
  }
};

/// Calls every dataset wrong.
struct StrictCheck : validate::Checker {
  std::vector<validate::CheckResult> finish(const validate::Dataset&,
                                            const validate::Sequence&) override {
    validate::CheckResult result;
    result.name = "broken.strict";
    result.value = 2.0;
    result.bound = 1.0;
    return {result};
  }
};

}  // namespace

sensors::SensorInfo throwing_sensor() { return sensor_row<ThrowingSensor>("broken.throwing"); }
sensors::SensorInfo hanging_sensor() { return sensor_row<HangingSensor>("broken.hanging"); }
sensors::SensorInfo nan_sensor() { return sensor_row<NanSensor>("broken.nan"); }
sensors::SensorInfo counting_sensor() { return sensor_row<CountingSensor>("broken.counting"); }
sensors::SensorInfo crashing_sensor() { return sensor_row<CrashingSensor>("broken.crashing"); }

sensors::SensorInfo leaving_sensor() { return sensor_row<LeavingSensor>("broken.leaving"); }

sensors::SensorInfo exiting_sensor() { return sensor_row<ExitingSensor>("broken.exiting"); }

sensors::SensorInfo nameless_sensor() { return sensor_row<NamelessSensor>("broken.nameless"); }
sensors::SensorInfo shadowing_sensor() { return sensor_row<ShadowingSensor>("broken.shadowing"); }
sensors::SensorInfo uncopied_sensor() { return sensor_row<UncopiedSensor>("broken.uncopied"); }
geo::CameraModelInfo shifted_camera() {
  return {.name = "broken.shifted",
          .summary = "pixels come back aside",
          .parameters = {},
          .make = [](const geo::CameraIntrinsics& intrinsics) {
            return std::unique_ptr<geo::CameraModel>(std::make_unique<ShiftedCamera>(intrinsics));
          }};
}

scene::MediumInfo brightening_medium() {
  return {.name = "broken.brightening", .summary = "brightens what is behind", .make = [] {
            return std::unique_ptr<scene::MediumOptions>(std::make_unique<BrighteningMedium>());
          }};
}

scene::MediumInfo absent_medium() {
  return {.name = "broken.absent", .summary = "makes nothing", .make = [] {
            return std::unique_ptr<scene::MediumOptions>(std::make_unique<AbsentMedium>());
          }};
}

tiler::LayerKindInfo counting_layer() {
  return {.name = "broken.counting", .summary = "depends on the order of tiles", .make = [] {
            return std::unique_ptr<tiler::LayerKind>(std::make_unique<CountingLayer>());
          }};
}

exporters::ExporterInfo dated_exporter() {
  return {.name = "broken.dated", .summary = "writes the time of day", .make = [] {
            return std::unique_ptr<exporters::Exporter>(std::make_unique<DatedExporter>());
          }};
}

validate::CheckInfo strict_check() {
  return {"broken.strict", "calls everything wrong", [](const validate::ValidateOptions&) {
            return std::unique_ptr<validate::Checker>(std::make_unique<StrictCheck>());
          }};
}

}  // namespace broken
