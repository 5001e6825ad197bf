// Linked into tests of windows under AddressSanitizer: drivers of OpenGL stay loaded until the end. One that is
// unloaded takes along what points to its memory, and the leak checker then reports leaks of a module without a name.
extern "C" int dlclose(void*) noexcept {
  return 0;
}
