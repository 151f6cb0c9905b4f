#include <algorithm>

#include "core/plugin_rows.h"
#include "core/registry.h"
#include "export/exporter.h"

// Every exporter, in alphabetical order: X(name) is export/name.cpp, which defines `ExporterInfo
// name_exporter()`.
#define TERRACAST_EXPORTERS(X) \
  X(coco) X(colmap) X(kitti) X(kitti_object) X(kitti_raw) X(tartanair) X(tartanair_v1) X(terracast)

namespace terracast::exporters {

#define TERRACAST_DECLARE(name) ExporterInfo name##_exporter();
TERRACAST_EXPORTERS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const ExporterInfo> exporters() {
#define TERRACAST_ENTRY(name) name##_exporter(),
  static const auto table =
      core::with_plugin_rows<ExporterInfo>({TERRACAST_EXPORTERS(TERRACAST_ENTRY)});
#undef TERRACAST_ENTRY
  return table;
}

bool Exporter::takes(const std::string& rig) const {
  const std::vector<std::string> named = rigs();
  return named.empty() || std::find(named.begin(), named.end(), rig) != named.end();
}

bool Exporter::takes_any_of(const std::vector<capture::CameraCalibration>& cameras) const {
  return std::any_of(
      cameras.begin(), cameras.end(),
      [this](const capture::CameraCalibration& camera) { return takes(camera.rig); });
}

ExportOptions::ExportOptions(const ExportOptions& other)
    : format(other.format), exporter_(other.exporter_ ? other.exporter_->clone() : nullptr) {}

ExportOptions& ExportOptions::operator=(const ExportOptions& other) {
  if (this == &other) return *this;
  format = other.format;
  exporter_ = other.exporter_ ? other.exporter_->clone() : nullptr;
  return *this;
}

void ExportOptions::describe(core::SchemaVisitor& visit) {
  const std::string before = format;
  visit.key("format", format, "Published format to write.",
            core::required(core::one_of(core::registry_names(exporters()))));
  if (format.empty()) return;  // a list of keys without a config
  if (!exporter_ || format != before)
    exporter_ = core::find_registered(exporters(), "export format", format).make();
  exporter_->describe(visit);
}

}  // namespace terracast::exporters
