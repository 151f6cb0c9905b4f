#include "plugins/loader.h"

#include <dlfcn.h>
#include <elf.h>

#include <algorithm>
#include <cfenv>
#include <cstring>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/printable.h"
#include "core/stop.h"
#include "export/exporter.h"
#include "geo/camera_model.h"
#include "plugins/blame.h"
#include "plugins/plugin.h"
#include "scene/media/medium.h"
#include "sensors/sensor.h"
#include "tiler/layer.h"
#include "validate/checks/checker.h"

namespace terracast::plugins {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// A type of table that plug-ins may add to.
struct TableType {
  std::string_view name;
  const std::type_info* type;
  KindInPlugin (*read)(std::string_view type, const void* info);
  bool (*has_maker)(const void* info);
};

template <class Info>
TableType table_type(std::string_view name) {
  return {.name = name,
          .type = &typeid(Info),
          .read =
              [](std::string_view type, const void* info) {
                const auto& row = *static_cast<const Info*>(info);
                return KindInPlugin{.type = type, .name = row.name, .summary = row.summary};
              },
          .has_maker =
              [](const void* info) { return static_cast<const Info*>(info)->make != nullptr; }};
}

std::span<const TableType> table_types() {
  static const TableType table[] = {
      table_type<geo::CameraModelInfo>("camera"),      table_type<validate::CheckInfo>("check"),
      table_type<exporters::ExporterInfo>("exporter"), table_type<tiler::LayerKindInfo>("layer"),
      table_type<scene::MediumInfo>("medium"),         table_type<sensors::SensorInfo>("sensor")};
  return table;
}

std::vector<KindInPlugin>& all_kinds() {
  static std::vector<KindInPlugin> kinds;
  return kinds;
}

/// Whether a file ends before what it says is loaded of it: touching that would end the process by SIGBUS. What is no
/// shared object is left to dlopen().
bool is_cut_off(const std::vector<std::byte>& bytes) {
  Elf64_Ehdr header;
  if (bytes.size() < sizeof header) return false;
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != ELFCLASS64 ||
      header.e_phentsize != sizeof(Elf64_Phdr))
    return false;
  const auto holds = [&](std::uint64_t offset, std::uint64_t size) {
    return offset <= bytes.size() && size <= bytes.size() - offset;
  };
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    const std::uint64_t at = header.e_phoff + i * sizeof(Elf64_Phdr);
    if (!holds(at, sizeof(Elf64_Phdr))) return true;
    Elf64_Phdr segment;
    std::memcpy(&segment, bytes.data() + at, sizeof segment);
    if (segment.p_type == PT_LOAD && !holds(segment.p_offset, segment.p_filesz)) return true;
  }
  return false;
}

/// The build that a file states; nothing: it is no plug-in.
std::string stated_build(const std::vector<std::byte>& bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view mark = TERRACAST_BUILD_MARK;
  for (std::size_t at = text.find(mark); at != std::string_view::npos;
       at = text.find(mark, at + 1)) {
    const std::string_view rest = text.substr(at + mark.size(), 1024);
    const std::size_t end = rest.find('\0');
    if (end != std::string_view::npos && rest.starts_with("terracast "))
      return core::printable(std::string(rest.substr(0, end)));
  }
  return {};
}

std::vector<std::string> fields_of(const std::string& build) {
  std::vector<std::string> fields;
  std::size_t at = 0;
  for (std::size_t end = 0; end != std::string::npos; at = end + 2) {
    end = build.find("; ", at);
    fields.push_back(build.substr(at, end == std::string::npos ? end : end - at));
  }
  return fields;
}

/// "interfaces 3f… (this program: interfaces 77…); Eigen 3.3.9 (this program: Eigen 3.4.0)"
std::string differences(const std::string& stated, const std::string& own) {
  const std::vector<std::string> a = fields_of(stated);
  const std::vector<std::string> b = fields_of(own);
  std::string text;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const std::string theirs = i < a.size() ? a[i] : "nothing";
    const std::string ours = i < b.size() ? b[i] : "nothing";
    if (theirs != ours)
      text += fmt::format("{}{} (this program: {})", text.empty() ? "" : "; ", theirs, ours);
  }
  return text;
}

/// dlopen(): runs the file's initialisers, of which one that throws ends the process by SIGABRT. Null: dlerror() says why.
void* opened(const fs::path& file) {
  const Loading loading(file);
  const core::StopSignalsEndTheProcess it_may_hang;
  // Objects built with -ffast-math have an initialiser that makes the processor round tiny numbers to 0.
  std::fenv_t before;
  std::fegetenv(&before);
  dlerror();
  void* handle = dlopen(fs::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  std::fesetenv(&before);
  return handle;
}

const PluginTable& table_of(const fs::path& file) {
  void* handle = opened(file);
  if (handle == nullptr)
    fail(ErrorKind::Input,
         "plug-in {}: cannot be loaded: {}; install the library that it needs, or build it again "
         "against this terracast",
         file.string(), core::printable(dlerror()));
  void* symbol = dlsym(handle, "terracast_plugin_v1");
  if (symbol == nullptr)
    fail(ErrorKind::Input,
         "plug-in {}: has no symbol terracast_plugin_v1; write TERRACAST_PLUGIN(…) in one of its "
         "sources",
         file.string());
  const PluginTable* table = nullptr;
  try {
    const Loading loading(file);
    const core::StopSignalsEndTheProcess it_may_hang;
    table = reinterpret_cast<const PluginTable* (*)()>(symbol)();
  } catch (...) {
    fail(ErrorKind::Input, "plug-in {}: threw while it built its table", file.string());
  }
  if (table == nullptr || table->num_bytes != sizeof(PluginTable) || table->name == nullptr ||
      table->version == nullptr || table->licence == nullptr)
    fail(ErrorKind::Input, "plug-in {}: its table is damaged", file.string());
  return *table;
}

/// That words can stand in a line of a list.
void check_words(std::string_view words, const std::string& what, const fs::path& file) {
  constexpr std::size_t kMostBytes = 1000;
  if (words.size() > kMostBytes || core::printable(words) != words)
    fail(ErrorKind::Input,
         "plug-in {}: its {} is \"{}\"; it takes {} bytes of UTF-8 at most, without control "
         "characters and \\x",
         file.string(), what, core::printable(core::first_letters(words, 100)), kMostBytes);
}

/// Reads and checks the rows of a plug-in.
std::vector<KindInPlugin> kinds_of(const PluginTable& table, const fs::path& file) {
  const std::string plugin = table.name;
  if (!core::is_plugin_name(plugin))
    fail(ErrorKind::Input,
         "plug-in {}: calls itself \"{}\"; a name is of a to z, 0 to 9 and _, and begins with a "
         "letter",
         file.string(), core::printable(plugin));
  if (!core::is_plugin_version(table.version))
    fail(ErrorKind::Input, "plug-in {}: its version is \"{}\"; write numbers with dots, as 1.2",
         file.string(), core::printable(std::string(table.version)));
  check_words(table.licence, "licence", file);
  if (table.num_rows == 0) fail(ErrorKind::Input, "plug-in {}: registers no kinds", file.string());
  std::set<std::pair<std::string_view, std::string_view>> names;
  std::vector<KindInPlugin> kinds;
  for (const core::PluginRow& row : std::span(table.rows, table.num_rows)) {
    const auto type = std::find_if(table_types().begin(), table_types().end(),
                                   [&](const TableType& one) { return *one.type == *row.type; });
    if (type == table_types().end())
      fail(ErrorKind::Input, "plug-in {}: a row is of the type {}, of which there is no table",
           file.string(), row.type->name());
    const KindInPlugin kind = type->read(type->name, row.info);
    const std::string name = core::printable(std::string(kind.name));
    if (!kind.name.starts_with(plugin + ".") ||
        !core::is_plugin_name(kind.name.substr(plugin.size() + 1)))
      fail(ErrorKind::Input,
           "plug-in {}: a {} is called \"{}\"; names of its kinds are {}.NAME, NAME of a to z, 0 "
           "to 9 and _",
           file.string(), type->name, name, plugin);
    if (*row.type == typeid(scene::MediumInfo) &&
        static_cast<const scene::MediumInfo*>(row.info)->is_always)
      fail(ErrorKind::Input,
           "plug-in {}: medium {} hangs in every scene; a plug-in's must be named by the config, "
           "so that pictures do not depend on what is loaded: leave is_always out",
           file.string(), name);
    if (kind.summary.empty() || !type->has_maker(row.info))
      fail(ErrorKind::Input, "plug-in {}: {} {} has no {}", file.string(), type->name, name,
           kind.summary.empty() ? "summary" : "maker");
    check_words(kind.summary, fmt::format("summary of {}", name), file);
    if (!names.emplace(kind.type, kind.name).second)
      fail(ErrorKind::Input, "plug-in {}: {} {} is defined twice", file.string(), type->name, name);
    kinds.push_back(kind);
  }
  return kinds;
}

}  // namespace

std::string load_plugin(const fs::path& file) {
  const std::vector<std::byte> bytes = core::read_file(file);
  const std::string hash = core::content_hash(bytes);
  for (const core::Plugin& loaded : core::plugins())
    if (loaded.content_hash == hash) return loaded.name;
  const std::string build = stated_build(bytes);
  if (build.empty())
    fail(ErrorKind::Input,
         "plug-in {}: is not a terracast plug-in; `terracast_add_plugin` of its CMake package "
         "builds one",
         file.string());
  if (build != TERRACAST_BUILD)
    fail(ErrorKind::Input,
         "plug-in {}: was built for another terracast ({}); build it again against this one",
         file.string(), differences(build, TERRACAST_BUILD));
  if (is_cut_off(bytes))
    fail(ErrorKind::Input, "plug-in {}: the file is cut off after {} bytes; copy or build it again",
         file.string(), bytes.size());
  const PluginTable& table = table_of(file);
  for (const core::Plugin& loaded : core::plugins())
    if (loaded.name == table.name)
      fail(ErrorKind::Input, "plug-in {}: the name {} is already taken by {}", file.string(),
           loaded.name, loaded.file.string());
  const std::vector<KindInPlugin> kinds = kinds_of(table, file);
  std::vector<std::string> names;
  for (const KindInPlugin& kind : kinds) names.emplace_back(kind.name);
  core::add_plugin({.name = table.name,
                    .version = table.version,
                    .licence = table.licence,
                    .file = fs::absolute(file),
                    .content_hash = hash,
                    .kinds = std::move(names)},
                   std::span(table.rows, table.num_rows));
  all_kinds().insert(all_kinds().end(), kinds.begin(), kinds.end());
  return table.name;
}

std::vector<FoundPlugin> plugins_on_path(std::string_view path_variable) {
  const std::string version = TERRACAST_INTERFACE_VERSION;
  const fs::path major_minor = version.substr(0, version.rfind('.'));
  std::vector<FoundPlugin> files;
  while (!path_variable.empty()) {
    const std::size_t end = std::min(path_variable.find(':'), path_variable.size());
    const fs::path folder(path_variable.substr(0, end));
    path_variable.remove_prefix(std::min(end + 1, path_variable.size()));
    if (folder.empty()) continue;
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
      files.push_back({.file = {}, .problem = folder.string() + " is no folder"});
      continue;
    }
    if (!fs::is_directory(folder / major_minor, ignored)) continue;  // plug-ins for other versions
    std::vector<fs::path> found;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(folder / major_minor, failed))
      if (entry.path().extension() == ".so") found.push_back(entry.path());
    if (failed)
      files.push_back({.file = {},
                       .problem = fmt::format("{} cannot be read: {}",
                                              (folder / major_minor).string(), failed.message())});
    std::sort(found.begin(), found.end());
    for (fs::path& file : found) files.push_back({.file = std::move(file), .problem = {}});
  }
  return files;
}

std::span<const KindInPlugin> kinds_in_plugins() { return all_kinds(); }

}  // namespace terracast::plugins
