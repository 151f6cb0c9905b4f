#include "rigs/yaml_file.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/text.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 22;
/// In one list: aliases make much of few bytes.
constexpr std::size_t kMostNumbers = 1000;

/// OpenCV writes a directive that YAML does not know, "%YAML:1.0".
std::string without_directive(std::string text) {
  if (text.starts_with("%YAML:")) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    text.replace(0, end, std::string(end, ' '));
  }
  return text;
}

}  // namespace

YamlValue::YamlValue(std::string file, std::string path, const YAML::Node& node)
    : file_(std::move(file)),
      path_(std::move(path)),
      node_(std::make_shared<const YAML::Node>(node)) {}

YamlValue YamlValue::read(const std::filesystem::path& file) {
  const std::string text = core::read_text_file(file, kMostBytes);
  try {
    return {file.string(), "", YAML::Load(without_directive(text))};
  } catch (const YAML::Exception& error) {
    fail(ErrorKind::Input, "{}:{}:{}: no YAML: {}", file.string(), error.mark.line + 1,
         error.mark.column + 1, error.msg);
  }
}

std::string YamlValue::where() const {
  const int line = node_->Mark().line;
  return fmt::format("{}{}{}", file_, line >= 0 ? fmt::format(":{}", line + 1) : "",
                     path_.empty() ? "" : ": " + path_);
}

bool YamlValue::has(std::string_view key) const {
  return node_->IsMap() && (*node_)[std::string(key)].IsDefined();
}

YamlValue YamlValue::at(std::string_view key) const {
  if (!node_->IsMap()) fail(ErrorKind::Input, "{} is no map; one with {} is wanted", where(), key);
  const YAML::Node node = (*node_)[std::string(key)];
  if (!node.IsDefined()) fail(ErrorKind::Input, "{} has no {}", where(), key);
  return {file_, path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key), node};
}

std::vector<std::string> YamlValue::keys() const {
  if (!node_->IsMap()) fail(ErrorKind::Input, "{} is no map", where());
  std::vector<std::string> keys;
  for (const auto& entry : *node_)
    if (entry.first.IsScalar()) keys.push_back(entry.first.Scalar());
  return keys;
}

std::vector<YamlValue> YamlValue::items() const {
  if (!node_->IsSequence()) fail(ErrorKind::Input, "{} is no list", where());
  std::vector<YamlValue> items;
  for (std::size_t i = 0; i < node_->size(); ++i)
    items.push_back({file_, fmt::format("{}[{}]", path_, i), (*node_)[i]});
  return items;
}

std::string YamlValue::text() const {
  if (!node_->IsScalar()) fail(ErrorKind::Input, "{} is no text", where());
  return node_->Scalar();
}

double YamlValue::number() const {
  if (node_->IsScalar())
    if (const auto value = geo::number_of(node_->Scalar())) return *value;
  fail(ErrorKind::Input, "{} is no finite number", where());
}

int YamlValue::size_px() const {
  const double value = number();
  if (!(value >= 1.0 && value <= 16384.0 && value == std::floor(value)))
    fail(ErrorKind::Input, "{} = {}; the side of an image has 1 to 16384 pixels", where(), value);
  return static_cast<int>(value);
}

std::vector<double> YamlValue::numbers(std::size_t count) const {
  std::vector<double> values;
  for (const YamlValue& item : items()) {
    if (values.size() > kMostNumbers)
      fail(ErrorKind::Input, "{} has more than {} numbers; no camera takes so many", where(),
           kMostNumbers);
    if (item.node_->IsSequence()) {
      for (const YamlValue& inner : item.items()) values.push_back(inner.number());
    } else {
      values.push_back(item.number());
    }
  }
  if (count != 0 && values.size() != count)
    fail(ErrorKind::Input, "{} has {} numbers; it takes {}", where(), values.size(), count);
  return values;
}

geo::Rigid3d YamlValue::rigid() const {
  const std::vector<double> m = numbers();
  if (m.size() != 12 && m.size() != 16)
    fail(ErrorKind::Input, "{} has {} numbers; it takes 3 or 4 rows of 4", where(), m.size());
  return rigid({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]});
}

geo::Rigid3d YamlValue::rigid(const std::vector<double>& rotation,
                              const std::vector<double>& translation) const {
  constexpr double kPrintedRotation = 1e-3;
  const Eigen::Matrix3d given =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  const double error = (given.transpose() * given - Eigen::Matrix3d::Identity()).norm();
  if (!(error < kPrintedRotation) || given.determinant() < 0.0)
    fail(ErrorKind::Input,
         "{} holds no rotation: its columns are not right-handed unit vectors at right angles",
         where());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()))
                          .normalized(),
          .translation = {translation[0], translation[1], translation[2]}};
}

}  // namespace terracast::rigs
