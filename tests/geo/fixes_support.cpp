#include "tests/geo/fixes_support.h"

#include <fmt/ranges.h>

#include <fstream>

#include "core/toml_reader.h"

namespace terracast::test {

std::unique_ptr<geo::FixFormat> format_from(const std::string& name, const std::string& toml) {
  struct Options {
    geo::FixFormat& format;
    void describe(core::SchemaVisitor& visit) { format.describe(visit); }
    void validate() const { format.validate(); }
  };
  for (const geo::FixFormatInfo& info : geo::fix_formats()) {
    if (info.name != name) continue;
    auto format = info.make();
    Options options{*format};
    core::TomlDocument::parse(toml, "test.toml").read(options);
    return format;
  }
  ADD_FAILURE() << "no format " << name;
  return nullptr;
}

std::filesystem::path Recordings::written(const std::string& name, const std::string& text) {
  const std::filesystem::path file = scratch_ / name;
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

geo::FixTable Recordings::read(const std::string& format, const std::string& toml,
                               const std::string& text, const std::string& above) {
  return format_from(format, toml)->read(written("recording", text), above);
}

std::string Recordings::refused(const std::string& format, const std::string& toml,
                                const std::string& text, core::ErrorKind kind,
                                const std::string& above) {
  return message_of(kind, [&] { read(format, toml, text, above); });
}

std::string remarks_of(const geo::FixTable& table) {
  return fmt::format("{}", fmt::join(table.remarks, "\n"));
}

}  // namespace terracast::test
