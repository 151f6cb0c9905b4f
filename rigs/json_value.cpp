#include "rigs/json_value.h"

#include <fmt/format.h>

#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::rigs {

using core::ErrorKind;
using core::fail;

JsonValue::JsonValue(std::shared_ptr<File> file, KeyRecord::Path path, const core::Json* json)
    : file_(std::move(file)), path_(std::move(path)), json_(json) {}

JsonValue JsonValue::read(const std::filesystem::path& file, std::size_t most_bytes) {
  const std::string text = core::read_text_file(file, most_bytes);
  auto read = std::make_shared<File>(
      File{file.string(), core::Json::parse(text, file.string()), KeyRecord{}});
  const core::Json* root = &read->root;
  return {std::move(read), {}, root};
}

std::string JsonValue::where() const {
  std::string path;
  for (const std::string& step : path_)
    path += (path.empty() || step.starts_with('[') ? "" : ".") + step;
  return file_->path + (path.empty() ? "" : ": " + path);
}

void JsonValue::open() const {
  if (file_->record.is_open(path_)) return;
  std::vector<std::string> keys;
  for (const auto& [key, value] : json_->members()) keys.push_back(key);
  file_->record.open(path_, keys, where());
}

bool JsonValue::has(std::string_view member) const {
  if (!json_->is_object()) return false;
  open();
  return json_->has(member);
}

JsonValue JsonValue::at(std::string_view member) const {
  if (!json_->is_object())
    fail(ErrorKind::Input, "{} is no object; one with {} is wanted", where(), member);
  if (!has(member)) fail(ErrorKind::Input, "{} has no {}", where(), member);
  KeyRecord::Path path = path_;
  path.emplace_back(member);
  file_->record.take(path);
  return {file_, std::move(path), &json_->at(member)};
}

std::vector<JsonValue> JsonValue::items() const {
  if (!json_->is_array()) fail(ErrorKind::Input, "{} is no list", where());
  std::vector<JsonValue> items;
  for (std::size_t i = 0; i < json_->size(); ++i) {
    KeyRecord::Path path = path_;
    path.push_back(fmt::format("[{}]", i));
    items.push_back({file_, std::move(path), &json_->at(i)});
  }
  return items;
}

void JsonValue::pass_over(const std::string& why) const { file_->record.pass_over(path_, why); }

void JsonValue::misunderstand(const std::string& value) const {
  file_->record.misunderstand(path_, value);
}

core::Ledger JsonValue::ledger(std::span<const core::KnownName> known) const {
  return file_->record.ledger(known);
}

}  // namespace terracast::rigs
