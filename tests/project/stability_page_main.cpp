// Prints docs/stability.md.
#include <cstdio>

#include "tests/project/stability_page.h"

int main() { return std::fputs(tessera::stability_page().c_str(), stdout) < 0 ? 1 : 0; }
