#include "plugins/plugin.h"

#include "broken/kinds.h"

TERRACAST_PLUGIN("broken", "0.1", "MIT", broken::throwing_sensor(), broken::hanging_sensor(),
                 broken::nan_sensor(), broken::counting_sensor(), broken::crashing_sensor(),
                 broken::leaving_sensor(), broken::exiting_sensor(), broken::nameless_sensor(),
                 broken::shadowing_sensor(), broken::uncopied_sensor(), broken::shifted_camera(),
                 broken::counting_layer(), broken::dated_exporter(), broken::brightening_medium(),
                 broken::absent_medium(), broken::strict_check())
