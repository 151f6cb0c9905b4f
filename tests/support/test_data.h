#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace terracast::test {

/// The folder of real terrain beside the checkout that some tests use; users do not have it.
inline std::filesystem::path shared_data() {
  return std::filesystem::path(TERRACAST_SOURCE_DIR).parent_path() / "shared" / "data";
}

/// Writes a file and the folders above it.
/// returns   the file
inline std::filesystem::path write_text(const std::filesystem::path& file,
                                        const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

/// A folder of its own for one test, empty at the start and removed at the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string(info->test_suite_name()) + "." + info->name();
    for (char& c : name)
      if (c == '/') c = '_';
    path_ = std::filesystem::temp_directory_path() /
            ("terracast-" + name + "-" + std::to_string(::getpid()));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace terracast::test

/// Skips the test, saying which file is missing, when the real data is not there.
#define TERRACAST_NEEDS_SHARED_DATA(relative)                                  \
  if (!std::filesystem::exists(::terracast::test::shared_data() / (relative))) \
  GTEST_SKIP() << "real data is missing: "                                     \
               << (::terracast::test::shared_data() / (relative)).string()
