// As a plug-in of an earlier terracast states its build. Were any of it run, it would say so.
#include <cstdio>
#include <cstdlib>

extern "C" {
[[gnu::used]] static const char terracast_plugin_build[] =
    "terracast-plugin-build: terracast 0.0.9; interfaces 0123456789abcdef; compiler gcc 4";
[[gnu::visibility("default")]] const void* terracast_plugin_v1() { std::abort(); }
}

namespace {
struct Loud {
  Loud() {
    std::puts("code of another build was run");
    std::abort();
  }
} loud;
}  // namespace
