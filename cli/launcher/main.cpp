#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

// `terracast` itself: says its version, and hands everything else over to terracast_program beside it. The program's
// libraries take 0.1 s to load, GDAL and OpenVDB nearly all of it, which this file does without.
namespace {

constexpr int kExitIo = 4;
constexpr int kExitInternal = 70;

int say_version() {
  if (std::puts(TERRACAST_VERSION) >= 0 && std::fflush(stdout) == 0) return 0;
  std::fprintf(stderr, "error: standard output: cannot be written: %s\n", std::strerror(errno));
  return kExitIo;
}

/// The folder of the file that runs, with a slash behind it; "": it cannot be found.
std::string own_folder() {
  std::string path(4096, '\0');
  const ssize_t size = readlink("/proc/self/exe", path.data(), path.size());
  if (size <= 0 || static_cast<std::size_t>(size) == path.size()) return "";
  path.resize(static_cast<std::size_t>(size));
  return path.substr(0, path.rfind('/') + 1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "--version") == 0) return say_version();
  const std::string folder = own_folder();
  if (folder.empty()) {
    std::fprintf(stderr,
                 "error: /proc/self/exe cannot be read, so that the program beside terracast is not found; start "
                 "terracast_program itself, or with /proc mounted\n");
    return kExitInternal;
  }
  const std::string program = folder + "terracast_program";
  execv(program.c_str(), argv);
  std::fprintf(stderr, "error: %s: cannot be started: %s; it belongs beside terracast\n",
               program.c_str(), std::strerror(errno));
  return kExitInternal;
}
