#include "tiler/apart/kept_forms.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <filesystem>
#include <set>

#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

namespace fs = std::filesystem;

/// "a.dat", "a.hdr", "a.dat.aux.xml" of stem "a"; not "ab.dat", "a_out".
bool is_beside(const fs::path& path, const std::string& stem) {
  const std::string name = path.filename().string();
  return name == stem || name.starts_with(stem + ".");
}

void add_all_like(const fs::path& file, std::set<fs::path>& files) {
  std::error_code error;
  const bool is_folder = fs::is_directory(file, error);
  const fs::path folder = is_folder                ? file
                          : file.has_parent_path() ? file.parent_path()
                                                   : fs::path(".");
  const std::string stem = file.stem().string();
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (is_folder || (is_beside(entry->path(), stem) && !entry->is_directory(error)))
      files.insert(entry->path());
}

}  // namespace

std::string state_of_files(const core::Path& file, const FileNames& further) {
  std::set<fs::path> files(further.begin(), further.end());
  add_all_like(plain_file(gdal_path(file)), files);
  std::string state;
  for (const fs::path& one : files) {
    struct stat status = {};
    if (::stat(one.c_str(), &status) != 0) continue;
    state += fmt::format("{} {} {} {} {}.{:09}\n", one.string(), status.st_dev, status.st_ino,
                         status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
  }
  return state;
}

}  // namespace terracast::tiler
