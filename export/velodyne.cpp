#include "export/velodyne.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <mutex>

#include "core/error.h"
#include "core/parallel.h"
#include "core/semantic_class.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {
namespace {

using core::SemanticClass;

static_assert(std::endian::native == std::endian::little);

template <class Number>
std::vector<std::byte> bytes_of(const std::vector<Number>& numbers) {
  const auto* at = reinterpret_cast<const std::byte*>(numbers.data());
  return {at, at + numbers.size() * sizeof(Number)};
}

/// SemanticKITTI's numbers, as semantic-kitti.yaml has them.
enum Label : std::uint16_t {
  kUnlabeled = 0,
  kCar = 10,
  kBus = 13,
  kOnRails = 16,
  kTruck = 18,
  kOtherVehicle = 20,
  kPerson = 30,
  kRoad = 40,
  kParking = 44,
  kSidewalk = 48,
  kOtherGround = 49,
  kBuilding = 50,
  kFence = 51,
  kLaneMarking = 60,
  kVegetation = 70,
  kTerrain = 72,
  kPole = 80,
  kOtherObject = 99,
  kMovingCar = 252,
  kMovingPerson = 254,
  kMovingOnRails = 256,
  kMovingBus = 257,
  kMovingTruck = 258,
  kMovingOtherVehicle = 259
};

/// Classes whose instances are counted.
bool is_counted(std::uint16_t label) {
  return (label >= kCar && label < kRoad) || label >= kMovingCar;
}

Label label_of_class(SemanticClass one) {
  switch (one) {
    case SemanticClass::Scree:
    case SemanticClass::Grass:
    case SemanticClass::Soil:
    case SemanticClass::Sand:
    case SemanticClass::ForestFloor:
    case SemanticClass::Cropland:
    case SemanticClass::Wetland:
      return kTerrain;
    case SemanticClass::Shrubland:
    case SemanticClass::Tree:
    case SemanticClass::Bush:
    case SemanticClass::Plant:
      return kVegetation;
    case SemanticClass::BuiltUp:
    case SemanticClass::Railway:
    case SemanticClass::Runway:
    case SemanticClass::Taxiway:
    case SemanticClass::Apron:
      return kOtherGround;
    case SemanticClass::Road:
      return kRoad;
    case SemanticClass::RoadMarking:
      return kLaneMarking;
    case SemanticClass::Path:
      return kSidewalk;
    case SemanticClass::Parking:
      return kParking;
    case SemanticClass::Building:
    case SemanticClass::Warehouse:
    case SemanticClass::Hangar:
      return kBuilding;
    case SemanticClass::Wall:
      return kFence;
    case SemanticClass::Car:
    case SemanticClass::Van:
      return kCar;
    case SemanticClass::Truck:
      return kTruck;
    case SemanticClass::Bus:
      return kBus;
    case SemanticClass::Train:
      return kOnRails;
    case SemanticClass::Aircraft:
    case SemanticClass::Helicopter:
    case SemanticClass::Ship:
    case SemanticClass::Boat:
    case SemanticClass::Drone:
      return kOtherVehicle;
    case SemanticClass::Person:
      return kPerson;
    case SemanticClass::StreetLamp:
      return kPole;
    case SemanticClass::Stone:
    case SemanticClass::Container:
    case SemanticClass::Crane:
    case SemanticClass::Pylon:
    case SemanticClass::PowerLine:
    case SemanticClass::WindTurbine:
    case SemanticClass::Object:
      return kOtherObject;
    default:  // water, rock, snow, bridges, piers, the apron beyond the world
      return kUnlabeled;
  }
}

}  // namespace

std::vector<std::byte> velodyne_bytes(std::span<const Eigen::Vector3d> places,
                                      std::span<const CloudPoint> points) {
  std::vector<float> numbers;
  numbers.reserve(4 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<float>(places[i][axis]));
    numbers.push_back(points[i].reflectance);
  }
  return bytes_of(numbers);
}

std::vector<Eigen::Vector3d> deskewed_places(const FrameScans& scans, int frame,
                                             std::span<const CloudPoint> points) {
  const geo::Rigid3d sensor_from_local = scans.local_from_sensor(frame).inverse();
  std::vector<Eigen::Vector3d> places;
  places.reserve(points.size());
  for (const CloudPoint& point : points) places.push_back(sensor_from_local * point.local);
  return places;
}

std::uint16_t semantic_kitti_label(std::uint8_t class_id, bool is_moving) {
  const Label label = label_of_class(static_cast<SemanticClass>(class_id));
  if (!is_moving) return label;
  switch (label) {
    case kCar:
      return kMovingCar;
    case kPerson:
      return kMovingPerson;
    case kOnRails:
      return kMovingOnRails;
    case kBus:
      return kMovingBus;
    case kTruck:
      return kMovingTruck;
    case kOtherVehicle:
      return kMovingOtherVehicle;
    default:
      return label;
  }
}

SemanticKittiLabels::SemanticKittiLabels(const FrameScans& scans) {
  const capture::SequenceInfo& info = scans.sequence().info();
  for (const capture::MovingBody& body : info.moving) moving_.insert(body.instance_id);
  std::mutex mutex;
  core::parallel_for(info.num_frames, [&](std::int64_t frame) {
    const std::vector<CloudPoint> points = scans.points(static_cast<int>(frame));
    std::map<std::uint16_t, std::set<std::uint32_t>> found;
    std::map<std::uint8_t, std::int64_t> num_unlabeled;
    for (const CloudPoint& point : points) {
      const std::uint16_t label = label_of(point);
      if (label == kUnlabeled) ++num_unlabeled[point.class_id];
      if (is_counted(label) && point.instance_id != 0) found[label].insert(point.instance_id);
    }
    const std::scoped_lock lock(mutex);
    for (const auto& [label, ids] : found)
      for (const std::uint32_t id : ids) instances_[label].emplace(id, 0);
    for (const auto& [class_id, count] : num_unlabeled) num_unlabeled_[class_id] += count;
    num_points_ += static_cast<std::int64_t>(points.size());
    most_points_of_frame_ =
        std::max(most_points_of_frame_, static_cast<std::int64_t>(points.size()));
  });
  constexpr std::size_t kMost = 65535;
  std::size_t count = 0;
  for (const auto& [label, numbers] : instances_) count += numbers.size();
  if (count > kMost)
    core::fail(
        core::ErrorKind::Input,
        "kitti: the points of {} in {} show {} instances; SemanticKITTI's labels number {} at "
        "most: shorter sequences, or lidar = \"off\", are right",
        scans.name(), info.name, count, kMost);
  // Numbers are of all classes together: users join moving and parked cars, and others, to one class.
  std::uint16_t number = 0;
  for (auto& [label, numbers] : instances_)
    for (auto& [id, its_number] : numbers) its_number = ++number;
}

std::uint16_t SemanticKittiLabels::label_of(const CloudPoint& point) const {
  return semantic_kitti_label(point.class_id, moving_.contains(point.instance_id));
}

std::vector<std::byte> SemanticKittiLabels::bytes(std::span<const CloudPoint> points) const {
  std::vector<std::uint32_t> labels;
  labels.reserve(points.size());
  for (const CloudPoint& point : points) {
    const std::uint16_t label = label_of(point);
    std::uint32_t instance = 0;
    if (is_counted(label) && point.instance_id != 0)
      instance = instances_.at(label).at(point.instance_id);
    labels.push_back(instance << 16 | label);
  }
  return bytes_of(labels);
}

std::string SemanticKittiLabels::instances_csv() const {
  if (instances_.empty()) return {};
  std::string text = "label,instance,instance_id\n";
  for (const auto& [label, numbers] : instances_)
    for (const auto& [id, number] : numbers) text += fmt::format("{},{},{}\n", label, number, id);
  return text;
}

core::Json SemanticKittiLabels::unlabeled() const {
  core::Json json = core::Json::object();
  for (const auto& [class_id, count] : num_unlabeled_)
    json.set(std::string(core::semantic_class_names()[class_id]), count);
  return json;
}

core::Json write_odometry_scans(const FrameScans& scans, const std::string& path,
                                DatasetWriter& writer, const core::Context& context) {
  const SemanticKittiLabels labels(scans);
  core::parallel_for(scans.sequence().info().num_frames, [&](std::int64_t i) {
    const auto frame = static_cast<int>(i);
    const std::string places_file = fmt::format("{}/velodyne/{:06}.bin", path, frame);
    const std::string labels_file = fmt::format("{}/labels/{:06}.label", path, frame);
    const bool has_places = writer.keep(places_file);
    const bool has_labels = writer.keep(labels_file);
    if (has_places && has_labels) return;
    const std::vector<CloudPoint> points = scans.points(frame);
    if (!has_places)
      writer.write(places_file, velodyne_bytes(deskewed_places(scans, frame, points), points));
    if (!has_labels) writer.write(labels_file, labels.bytes(points));
  });
  const std::string instances = labels.instances_csv();
  if (!instances.empty()) writer.write(path + "/instances.csv", instances);
  // KITTI's own readers in C++ hold a million numbers.
  constexpr std::int64_t kMostOfReaders = 250'000;
  if (labels.most_points_of_frame() > kMostOfReaders)
    context.log.warn(
        "kitti: a scan of {} has {} points; the format's readers in C++ take the first {}",
        scans.name(), labels.most_points_of_frame(), kMostOfReaders);
  core::Json lidar = describe_lidar(scans, labels.num_points());
  lidar.set("num_points_without_label", labels.unlabeled());
  return lidar;
}

core::Json write_raw_scans(const FrameScans& scans, const std::string& path,
                           DatasetWriter& writer) {
  const capture::SequenceInfo& info = scans.sequence().info();
  const std::string folder = path + "/velodyne_points";
  std::atomic<std::int64_t> num_points = 0;
  core::parallel_for(info.num_frames, [&](std::int64_t i) {
    const auto frame = static_cast<int>(i);
    const std::vector<CloudPoint> points = scans.points(frame);
    num_points += static_cast<std::int64_t>(points.size());
    writer.write_kept(fmt::format("{}/data/{:010}.bin", folder, frame), [&] {
      std::vector<Eigen::Vector3d> places;
      places.reserve(points.size());
      for (const CloudPoint& point : points) places.push_back(point.in_sensor);
      return velodyne_bytes(places, points);
    });
  });
  std::string begins, middles, ends;
  for (const capture::FrameRecord& record : scans.sequence().frames()) {
    const auto line = [&](double time_s) {
      return utc_with_nanoseconds(info.utc_start, time_s) + "\n";
    };
    begins += line(scans.begin_s(record.index));
    middles += line(record.time_s);
    ends += line(scans.end_s(record.index));
  }
  writer.write(folder + "/timestamps_start.txt", begins);
  writer.write(folder + "/timestamps.txt", middles);
  writer.write(folder + "/timestamps_end.txt", ends);
  return describe_lidar(scans, num_points);
}

}  // namespace terracast::exporters
