#include "labels/label_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <system_error>

#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/semantic_class.h"

namespace terracast::labels {

namespace fs = std::filesystem;
using core::Json;

Json begin_index(std::string_view kind, int version, const capture::SequenceReader& sequence,
                 const ChannelMeanings& channels) {
  Json meanings = Json::object();
  for (const auto& [channel, meaning] : channels) meanings.set(channel, meaning);
  Json index = Json::object();
  index.set("format", fmt::format("terracast {}", kind))
      .set("version", version)
      .set("capture", capture::labels_source(sequence))
      .set("channels", std::move(meanings));
  return index;
}

Json classes_json() {
  Json list = Json::array();
  for (const core::SemanticClassInfo& info : core::semantic_classes()) {
    Json color = Json::array();
    for (const std::uint8_t value : info.color_srgb) color.push(static_cast<int>(value));
    list.push(Json::object()
                  .set("id", static_cast<int>(info.id))
                  .set("name", info.name)
                  .set("supercategory", info.parent)
                  .set("isthing", info.is_thing ? 1 : 0)
                  .set("color", std::move(color)));
  }
  return list;
}

void remove_index(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error)
    core::fail(core::ErrorKind::Io, "{}: cannot be removed: {}", file.string(), error.message());
}

bool holds(const fs::path& file, std::span<const std::byte> bytes) {
  std::error_code none;
  if (!fs::is_regular_file(file, none) || fs::file_size(file, none) != bytes.size()) return false;
  const std::vector<std::byte> present = core::read_file(file);
  return std::equal(present.begin(), present.end(), bytes.begin(), bytes.end());
}

bool write_unless_same(const fs::path& file, std::span<const std::byte> bytes) {
  if (holds(file, bytes)) return false;
  core::write_file(file, bytes);
  return true;
}

void write_index(const fs::path& file, const Json& index, int indent) {
  const std::string text = index.text(indent) + "\n";
  write_unless_same(file, std::as_bytes(std::span(text)));
}

}  // namespace terracast::labels
