#pragma once

#include <string>
#include <vector>

namespace terracast::exporters {

/// Forms in which scans are written once more for other programs, beside those that every dataset has.
struct ScanForms {
  std::vector<std::string> clouds = {};  ///< of lidars: some of cloud_forms()
  std::vector<std::string> events = {};  ///< of event cameras: some of event_forms()
  bool operator==(const ScanForms&) const = default;
};

}  // namespace terracast::exporters
