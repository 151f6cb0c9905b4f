#include "labels/finished.h"

#include "core/error.h"
#include "core/hash.h"

namespace terracast::labels {

bool is_label_finished(const std::filesystem::path& record, const std::filesystem::path& file,
                       const core::Json& wanted) {
  if (!std::filesystem::exists(record) || !std::filesystem::exists(file)) return false;
  try {
    const core::Json present = core::Json::read(record);
    for (const auto& [member, value] : wanted.members())
      if (!present.has(member) || present.at(member).text() != value.text()) return false;
    return present.at("xxh3_128").string() == core::content_hash_of_file(file);
  } catch (const core::Error& error) {
    if (error.kind() == core::ErrorKind::Input) return false;
    throw;
  }
}

}  // namespace terracast::labels
