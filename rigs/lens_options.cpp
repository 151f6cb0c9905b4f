#include "rigs/lens_options.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <vector>

#include "core/error.h"
#include "core/key_hints.h"
#include "core/registry.h"

namespace terracast::rigs {

namespace {

constexpr const char* kRaysKey = "rays";

/// Says of the keys of other models whose they are.
void hint_at_other_models(const geo::CameraModelInfo& model, core::SchemaVisitor& visit) {
  auto* hints = dynamic_cast<core::KeyHints*>(&visit);
  if (hints == nullptr) return;
  std::map<std::string, std::vector<std::string_view>, std::less<>> models_with;
  const auto add = [&](std::string_view key, std::string_view name) {
    models_with[std::string(key)].push_back(name);
  };
  for (const geo::CameraModelInfo& other : geo::camera_models()) {
    if (other.read != nullptr)
      add(kRaysKey, other.name);
    else
      for (const geo::CameraParameter& parameter : other.parameters)
        add(parameter.name, other.name);
  }
  for (const auto& [key, names] : models_with)
    if (std::find(names.begin(), names.end(), model.name) == names.end())
      hints->hint(key, fmt::format("the model {} has none; models that do are {}", model.name,
                                   fmt::join(names, ", ")));
}

}  // namespace

void LensOptions::set_model(const std::string& model) {
  if (model_ != nullptr && model_->name == model) return;
  model_ = &core::find_registered(geo::camera_models(), "camera model", model);
  own_.clear();
  for (const geo::CameraParameter& parameter : model_->parameters)
    own_.push_back(parameter.default_value);
}

void LensOptions::set_own_parameters(std::span<const double> own) {
  if (model_->read != nullptr)
    core::fail(core::ErrorKind::Config,
               "a camera of the model {} takes its rays from a file, not from keys", model_->name);
  if (own.size() != own_.size())
    core::fail(core::ErrorKind::Config,
               "{} parameters of the model {} beside fx, fy, cx, cy; it has {}", own.size(),
               model_->name, own_.size());
  own_.assign(own.begin(), own.end());
}

void LensOptions::describe(core::SchemaVisitor& visit) {
  hint_at_other_models(*model_, visit);
  if (model_->read != nullptr) {
    visit.key(
        kRaysKey, rays_,
        "Text file with a line for each node of a grid over the image, row by row: u v (image "
        "point, pixel centres at +0.5), x y z (its ray; x right, y down, z forward).");
    return;
  }
  for (std::size_t i = 0; i < own_.size(); ++i) {
    const geo::CameraParameter& parameter = model_->parameters[i];
    visit.key(parameter.name, own_[i], parameter.meaning,
              core::between(parameter.lowest, parameter.highest));
  }
}

std::vector<double> LensOptions::parameters(double fx, double fy, double cx, double cy) const {
  if (model_->read != nullptr) {
    if (rays_.empty())
      core::fail(core::ErrorKind::Config,
                 "no rays; a camera of the model {} takes them from a file", model_->name);
    return model_->read(rays_.resolved);
  }
  std::vector<double> parameters{fx, fy, cx, cy};
  parameters.insert(parameters.end(), own_.begin(), own_.end());
  return parameters;
}

}  // namespace terracast::rigs
