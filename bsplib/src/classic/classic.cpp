// BSPlib as in the paper of 1998: sizes and process numbers are int.
#define BSP2_NO_INLINE
#define BSP2_NO_PLACES
#include "bsp.h"
#include "classic/classic_api.hpp"
#include "classic/classic_dialect.hpp"

namespace classic = bsp2::bsplib::classic;

extern "C" {

void bsp_init(void (*spmd)(void), int argc, char** argv) { classic::init(spmd, argc, argv); }

void bsp_end(void) { classic::end(); }

void bsp_abort(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  classic::abort_with(format, arguments);
}

void bsp_abort_va(const char* format, va_list arguments) { classic::abort_with(format, arguments); }

void bsp_vabort(const char* format, va_list arguments) { classic::abort_with(format, arguments); }

double bsp_time(void) { return classic::engine("bsp_time").time(); }

void bsp_sync(void) { classic::sync("bsp_sync"); }

void bsp_pop_reg(const void* address) {
  auto& world = classic::engine("bsp_pop_reg");
  classic::guarded("bsp_pop_reg", [&] { world.pop_reg(address); });
}

}  // extern "C"
