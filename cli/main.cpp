#include "cli/commands.h"

int main(int argc, char** argv) { return terracast::cli::run_command_line(argc, argv); }
