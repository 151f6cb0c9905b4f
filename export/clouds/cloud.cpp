#include "export/clouds/cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "export/clouds/las.h"
#include "export/stream_columns.h"
#include "geo/geoid.h"
#include "geo/gps_time.h"
#include "geo/sun.h"
#include "geo/utm.h"

namespace terracast::exporters {
namespace {

/// On the map, of the points of one sequence.
class LasMap {
 public:
  LasMap(const capture::SequenceReader& sequence, const LocalFrame& local)
      : frame_(local.origin),
        geoid_(geo::Geoid::egm96()),
        zone_(geo::utm_zone(local.origin.lat_deg, local.origin.lon_deg)),
        utc_start_(sequence.info().utc_start),
        gps_start_s_(geo::gps_seconds_from_unix(geo::unix_seconds_from_utc(utc_start_))) {}

  LasPoint placed(const CloudPoint& point) const {
    const geo::Geodetic place = frame_.geodetic_from_world(point.local);
    const geo::UtmPlace map = geo::utm_from_geodetic(zone_, place.lat_deg, place.lon_deg);
    const Eigen::Vector3d beam = (point.local - point.origin_local).normalized();
    const double down = std::clamp(-beam.dot(frame_.up_world(point.origin_local)), -1.0, 1.0);
    const double off_deg = std::acos(down) * 180.0 / std::numbers::pi;
    return {.easting_m = map.easting_m,
            .northing_m = map.northing_m,
            .height_m = place.height_m - geoid_->undulation_m(place.lat_deg, place.lon_deg),
            .gps_s = gps_start_s_ + point.time_s,
            .scan_angle_deg = point.in_sensor.y() > 0.0 ? -off_deg : off_deg,
            .reflectance = point.reflectance,
            .return_number = point.return_number,
            .num_returns = point.num_returns,
            .classification = las_classification(point.class_id),
            .true_range_m = point.true_range_m,
            .incidence_rad = point.incidence_rad,
            .instance_id = point.instance_id,
            .class_id = point.class_id};
  }
  std::vector<std::byte> file(const std::vector<LasPoint>& points, std::uint16_t strip) const {
    return las_bytes(points,
                     utm_egm96_wkt(zone_.epsg(), zone_.central_meridian_deg(), zone_.is_north),
                     utc_start_, static_cast<std::uint16_t>(strip + 1));
  }

 private:
  geo::WorldFrame frame_;
  std::shared_ptr<const geo::Geoid> geoid_;
  geo::UtmZone zone_;
  std::string utc_start_;
  double gps_start_s_;
};

void write_las(DatasetWriter& writer, const std::string& folder,
               const capture::SequenceReader& sequence, int stream_index) {
  const LocalFrame local = local_frame(sequence);
  const LasMap map(sequence, local);
  std::vector<LasPoint> points;
  std::uint16_t strip = 0;
  const auto write = [&] {
    writer.write_kept(fmt::format("{}/strip_{:03}.las", folder, strip),
                      [&] { return map.file(points, strip); });
    points.clear();
    ++strip;
  };
  for (int frame = 0; frame < sequence.info().num_frames; ++frame) {
    const std::vector<CloudPoint> cloud = cloud_of(sequence, stream_index, frame, local);
    if (!points.empty() && points.size() + cloud.size() > kMostLasPoints) write();
    for (const CloudPoint& point : cloud) points.push_back(map.placed(point));
  }
  write();
}

}  // namespace

std::vector<CloudPoint> cloud_of(const capture::SequenceReader& sequence, int stream_index,
                                 int frame, const LocalFrame& local) {
  const capture::StreamInfo& stream =
      sequence.info().streams[static_cast<std::size_t>(stream_index)];
  const capture::Samples scans = sequence.read_samples(stream_index, frame);
  const StreamColumns columns(stream);
  const std::size_t world = columns.at("world_x_m"), origin = columns.at("world_origin_x_m"),
                    sensor = columns.at("x_m"), range = columns.at("range_m"),
                    true_range = columns.at("true_range_m"),
                    reflectance = columns.at("reflectance"),
                    incidence = columns.at("incidence_rad"), ring = columns.at("ring"),
                    number = columns.at("return_number"), returns = columns.at("num_returns"),
                    class_id = columns.at("class_id"), instance = columns.at("instance_id");
  std::vector<CloudPoint> points;
  points.reserve(scans.times_s.size());
  for (std::size_t row = 0; row < scans.times_s.size(); ++row) {
    const double* values = &scans.values[row * stream.channels.size()];
    const auto point = [values](std::size_t first) {
      return Eigen::Vector3d(values[first], values[first + 1], values[first + 2]);
    };
    const double true_m = values[true_range];
    const Eigen::Vector3d from = local.local_from_world * point(origin);
    const Eigen::Vector3d to = local.local_from_world * point(world);
    points.push_back({.time_s = scans.times_s[row],
                      .local = to + (values[range] - true_m) / true_m * (to - from),
                      .origin_local = from,
                      .in_sensor = point(sensor),
                      .true_range_m = true_m,
                      .reflectance = static_cast<float>(values[reflectance]),
                      .incidence_rad = static_cast<float>(values[incidence]),
                      .ring = static_cast<std::uint16_t>(values[ring]),
                      .return_number = static_cast<std::uint8_t>(values[number]),
                      .num_returns = static_cast<std::uint8_t>(values[returns]),
                      .class_id = static_cast<std::uint8_t>(values[class_id]),
                      .instance_id = static_cast<std::uint32_t>(values[instance])});
  }
  return points;
}

std::vector<std::string> cloud_forms() { return {"las", "pcd", "ply"}; }

void write_clouds(DatasetWriter& writer, const std::string& folder,
                  const capture::SequenceReader& sequence, const std::vector<std::string>& forms) {
  const LocalFrame local = local_frame(sequence);
  for (std::size_t i = 0; i < sequence.info().streams.size(); ++i) {
    const capture::StreamInfo& stream = sequence.info().streams[i];
    if (stream.kind != "lidar") continue;
    const std::string path = fmt::format("{}/sensors/{}/{}", folder, stream.rig, stream.name);
    const auto wants = [&](std::string_view form) {
      return std::find(forms.begin(), forms.end(), form) != forms.end();
    };
    if (wants("las")) write_las(writer, path, sequence, static_cast<int>(i));
    for (const auto& [form, bytes_of] : {std::pair{"pcd", &pcd_bytes}, {"ply", &ply_bytes}}) {
      if (!wants(form)) continue;
      for (int frame = 0; frame < sequence.info().num_frames; ++frame)
        writer.write_kept(fmt::format("{}/{:06}.{}", path, frame, form), [&] {
          return bytes_of(cloud_of(sequence, static_cast<int>(i), frame, local));
        });
    }
  }
}

}  // namespace terracast::exporters
