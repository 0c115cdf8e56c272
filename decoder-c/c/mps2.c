/* The smallest program for an emulated Cortex-M4 (QEMU, mps2-an386): vectors, start, and text by semihosting. */
#include <stdint.h>

#include "draw.h"

extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;
extern const uint8_t bundle_start[], bundle_end[];

/* The bundle lies in flash as it is; NAME and FILE come from the command line of the compiler. */
__asm__(".pushsection .rodata.bundle,\"a\"\n.balign 4\n.global bundle_start, bundle_end\nbundle_start: .incbin \"" FILE
        "\"\nbundle_end:\n.popsection\n");

static int semihost(int operation, const void *argument) {
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void say(const char *text) { semihost(4, text); }

/* There is one core. */
void do_both(void *user, psb_task here, psb_task there) {
  (void)user;
  there.run(there.state);
  here.run(here.state);
}

_Noreturn static void leave(int failed) {
  /* SYS_EXIT: ADP_Stopped_ApplicationExit, or a run-time error. */
  semihost(0x18, (const void *)(uintptr_t)(failed ? 0x20023 : 0x20026));
  for (;;) {
  }
}

_Noreturn static void fault(void) {
  say("fault\n");
  leave(1);
}

_Noreturn static void start(void) {
  const uint32_t *from = &data_load;
  for (uint32_t *to = &data_start; to < &data_end;) *to++ = *from++;
  for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
  /* The floating-point unit, which is off after reset. */
  *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
  __asm__ volatile("dsb\nisb");
  leave(draw_orbit(NAME, bundle_start, (size_t)(bundle_end - bundle_start)));
}

struct vectors {
  uint32_t *stack;
  void (*handlers[15])(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
    &stack_top, {start, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, fault}};
