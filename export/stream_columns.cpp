#include "export/stream_columns.h"

#include <algorithm>
#include <cstdlib>

#include "core/error.h"

namespace terracast::exporters {

std::size_t StreamColumns::at(std::string_view name) const {
  const auto found =
      std::find_if(stream_.channels.begin(), stream_.channels.end(),
                   [&](const capture::StreamChannel& each) { return each.name == name; });
  if (found == stream_.channels.end())
    core::fail(core::ErrorKind::Input,
               "sensor {}/{} ({}) has no channel {}: an earlier version captured it; capture it "
               "again",
               stream_.rig, stream_.name, stream_.kind, name);
  return static_cast<std::size_t>(found - stream_.channels.begin());
}

std::vector<std::size_t> StreamColumns::of_axes(const std::string& start, std::string_view axes,
                                                const std::string& end) const {
  std::vector<std::size_t> columns;
  for (const char axis : axes) columns.push_back(at(start + axis + end));
  return columns;
}

namespace {

/// What stands behind "key = " in a section of the settings.
std::string value_of_settings(const capture::StreamInfo& stream, std::string_view section,
                              std::string_view key) {
  const std::string& toml = stream.settings_toml;
  std::string_view here;
  for (std::size_t at = 0; at < toml.size();) {
    const std::size_t end = std::min(toml.find('\n', at), toml.size());
    const std::string_view line = std::string_view(toml).substr(at, end - at);
    at = end + 1;
    if (line.starts_with("[")) here = line.substr(1, line.find(']') - 1);
    const std::size_t equals = line.find(" = ");
    if (equals != std::string_view::npos && here == section && line.substr(0, equals) == key)
      return std::string(line.substr(equals + 3));
  }
  core::fail(core::ErrorKind::Input,
             "the settings of sensor {}/{} ({}) have no key {}{}{}: an earlier version captured "
             "it; capture it again",
             stream.rig, stream.name, stream.kind, section, section.empty() ? "" : ".", key);
}

}  // namespace

double number_of_settings(const capture::StreamInfo& stream, std::string_view section,
                          std::string_view key) {
  return std::strtod(value_of_settings(stream, section, key).c_str(), nullptr);
}

std::string text_of_settings(const capture::StreamInfo& stream, std::string_view key) {
  const std::string quoted = value_of_settings(stream, "", key);
  return quoted.size() < 2 ? "" : quoted.substr(1, quoted.size() - 2);
}

}  // namespace terracast::exporters
