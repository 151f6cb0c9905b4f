#include <algorithm>
#include <array>
#include <fstream>

#include "core/error.h"
#include "core/registry.h"
#include "rigs/rig_format.h"

// Every format, in alphabetical order: X(name) is rigs/formats/name.cpp, which defines
// `RigFormatInfo name_rigs()`.
#define TERRACAST_RIG_FORMATS(X) X(colmap) X(csv) X(kalibr) X(opencv) X(xlsx)

namespace terracast::rigs {

#define TERRACAST_DECLARE(name) RigFormatInfo name##_rigs();
TERRACAST_RIG_FORMATS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const RigFormatInfo> rig_formats() {
#define TERRACAST_ENTRY(name) name##_rigs(),
  static const std::array table = {TERRACAST_RIG_FORMATS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

const RigFormatInfo& find_rig_format(const std::filesystem::path& path) {
  std::string first_bytes(256, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(first_bytes.data(), static_cast<std::streamsize>(first_bytes.size()));
  first_bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  for (const RigFormatInfo& format : rig_formats())
    if (format.recognises(path, first_bytes)) return format;
  core::fail(core::ErrorKind::Input,
             "{}: its name tells no format of rigs; give --format, one of {}", path.string(),
             fmt::join(core::registry_names(rig_formats()), ", "));
}

}  // namespace terracast::rigs
