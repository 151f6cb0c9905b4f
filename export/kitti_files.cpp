#include "export/kitti_files.h"

#include <cmath>

#include "capture/labels.h"
#include "core/image_io.h"

namespace terracast::exporters {

core::Image8 grey_of(const core::Image8& color) {
  core::Image8 grey(color.width(), color.height());
  for (std::size_t i = 0; i < grey.data().size(); ++i) {
    const std::uint8_t* p = &color.data()[3 * i];
    grey.data()[i] = static_cast<std::uint8_t>((299 * p[0] + 587 * p[1] + 114 * p[2] + 500) / 1000);
  }
  return grey;
}

std::string number_line(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  std::string line;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      // Adding 0 turns -0 into 0.
      line += fmt::format("{}{:.12e}", line.empty() ? "" : " ", matrix(row, column) + 0.0);
  return line;
}

Eigen::Matrix3d kitti_camera_matrix(const capture::CameraCalibration& camera) {
  const std::vector<double>& p = camera.intrinsics.parameters;
  return (Eigen::Matrix3d() << p[0], 0, p[2] - 0.5, 0, p[1], p[3] - 0.5, 0, 0, 1).finished();
}

Eigen::Matrix<double, 3, 4> kitti_projection(const capture::CameraCalibration& camera,
                                             double offset_m) {
  Eigen::Matrix<double, 3, 4> projection;
  projection << kitti_camera_matrix(camera),
      Eigen::Vector3d(-camera.intrinsics.parameters[0] * offset_m, 0.0, 0.0);
  return projection;
}

std::string relative_poses(const capture::SequenceReader& sequence, const LocalFrame& local,
                           int camera_index) {
  const geo::Rigid3d first_from_local =
      local_from_camera(local, sequence, 0, camera_index).inverse();
  std::string text;
  for (const capture::FrameRecord& record : sequence.frames()) {
    const geo::Rigid3d first_from_camera =
        record.index == 0
            ? geo::Rigid3d{}
            : first_from_local * local_from_camera(local, sequence, record.index, camera_index);
    Eigen::Matrix<double, 3, 4> matrix;
    matrix << first_from_camera.rotation.toRotationMatrix(), first_from_camera.translation;
    text += number_line(matrix) + "\n";
  }
  return text;
}

void write_grey_and_color(const capture::SequenceReader& sequence, int frame, int camera_index,
                          const std::string& grey_file, const std::string& color_file,
                          DatasetWriter& writer) {
  const bool has_grey = writer.keep(grey_file);
  const bool has_color = writer.keep(color_file);
  if (has_grey && has_color) return;
  const core::Image8 color =
      sequence.read_camera(frame, camera_index, capture::SequenceReader::kColor).color;
  if (!has_grey) writer.write(grey_file, core::encode_png(grey_of(color)));
  if (!has_color) writer.write(color_file, core::encode_png(color));
}

core::ImageF depth_with_empty_sky(const capture::SequenceReader& sequence, int frame,
                                  int camera_index) {
  const auto model =
      geo::make_camera(sequence.info().cameras[static_cast<std::size_t>(camera_index)].intrinsics);
  core::ImageF depth_m = capture::depth_image(
      *model, sequence.read_camera(frame, camera_index, capture::SequenceReader::kFacts).range_m);
  for (float& value : depth_m.data())
    if (std::isinf(value)) value = 0.0F;
  return depth_m;
}

}  // namespace terracast::exporters
