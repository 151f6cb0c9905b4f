#include <algorithm>

#include "core/plugin_rows.h"
#include "core/registry.h"
#include "export/clouds/cloud.h"
#include "export/events/dsec.h"
#include "export/exporter.h"

// Every exporter, in alphabetical order: X(name) is export/name.cpp, which defines `ExporterInfo
// name_exporter()`.
#define TERRACAST_EXPORTERS(X) \
  X(coco)                      \
  X(colmap)                    \
  X(euroc)                     \
  X(kitti) X(kitti_object) X(kitti_raw) X(mcap) X(tartanair) X(tartanair_v1) X(terracast) X(tum)

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

void ExportOptions::describe(core::SchemaVisitor& visit) {
  visit.key("format", format, "Published format to write.",
            core::required(core::one_of(core::registry_names(exporters()))));
  // A list of keys without a config has none.
  if (!format.empty()) exporter_.describe(visit, exporters(), "export format", format);
  visit.key(
      "clouds", scan_forms_.clouds,
      "Also write clouds of lidars as other programs read them: las (LAS 1.4, a map of UTM), pcd "
      "and ply (a file a frame, in the poses' frame). They stand beside the scans.",
      core::one_of(cloud_forms()));
  visit.key(
      "events", scan_forms_.events,
      "Also write events of event cameras as other programs read them: dsec (HDF5 as DSEC has "
      "it). They stand beside the scans.",
      core::one_of(event_forms()));
  if (!exporter_.is_made() || exporter_->scan_forms == scan_forms_) return;
  std::unique_ptr<Exporter> with_forms = exporter_->clone();
  with_forms->scan_forms = scan_forms_;
  exporter_.set(format, std::move(with_forms));
}

}  // namespace terracast::exporters
