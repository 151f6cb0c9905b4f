#include "validate/readers/stated_model.h"

namespace terracast::validate {

void complete_stated(Camera& camera) {
  if (!camera.stated) return;
  const std::vector<double>& p = camera.stated_model.parameters;
  const std::vector<double> own =
      p.size() > 4 ? std::vector<double>(p.begin() + 4, p.end()) : std::vector<double>();
  camera.stated->plane = make_camera_plane(camera.stated_model.name, own);
}

void adopt_stated(Camera& camera, Findings& findings) {
  if (!camera.stated) return;
  if (camera.stated_model.name != "pinhole")
    findings.attempt("dataset.json", [&] { complete_stated(camera); });
  camera.intrinsics = *camera.stated;
}

}  // namespace terracast::validate
