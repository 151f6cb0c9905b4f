// States this very build, and has no table.
#include "plugins/plugin.h"

extern "C" {
[[gnu::used]] static const char terracast_plugin_build[] = TERRACAST_BUILD_MARK TERRACAST_BUILD;
}
