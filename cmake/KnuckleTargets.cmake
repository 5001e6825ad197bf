# Compiler settings shared by every target, and the two calls that make one:
#   knuckle_library(NAME deps...)   one static library per folder
#   knuckle_tests(NAME deps...)     one GoogleTest binary per test folder

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# -O2 keeps IEEE semantics (digests repeat); asserts of Eigen stay out of the loops.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} ${CCACHE})
endif()

add_library(knuckle_options INTERFACE)
target_compile_options(knuckle_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
                                                 -Wnon-virtual-dtor -Woverloaded-virtual -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Eigen's unrolled fixed-size kernels make g++ 12 claim out-of-bounds accesses that are not there.
  target_compile_options(knuckle_options INTERFACE -Wno-array-bounds -Wno-maybe-uninitialized -Wno-stringop-overread)
endif()
if(KNUCKLE_SANITIZE)
  target_compile_options(knuckle_options INTERFACE -fsanitize=${KNUCKLE_SANITIZE} -fno-omit-frame-pointer
                                                   -fno-sanitize-recover=all)
  target_link_options(knuckle_options INTERFACE -fsanitize=${KNUCKLE_SANITIZE})
endif()
if(KNUCKLE_COVERAGE)
  target_compile_options(knuckle_options INTERFACE --coverage -O0)
  target_link_options(knuckle_options INTERFACE --coverage)
endif()

function(knuckle_library name)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(sources)
    add_library(knuckle_${name} STATIC ${sources})
    set(scope PUBLIC)
    target_precompile_headers(knuckle_${name} PRIVATE <Eigen/Dense> <array> <cstdint> <optional> <string> <vector>)
  else()
    add_library(knuckle_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(knuckle_${name} ${scope} ${PROJECT_SOURCE_DIR})
  target_link_libraries(knuckle_${name} ${scope} knuckle_options Eigen3::Eigen Threads::Threads ${ARGN})
endfunction()

function(knuckle_tests name)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  # Object libraries are not passed on by others: each test binary holds the counting malloc itself.
  target_link_libraries(test_${name} PRIVATE ${ARGN} knuckle_no_alloc GTest::gtest_main)
  target_precompile_headers(test_${name} PRIVATE <Eigen/Dense> <gtest/gtest.h> <array> <string> <vector>)
  target_compile_definitions(test_${name} PRIVATE KNUCKLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  gtest_discover_tests(test_${name} TEST_PREFIX ${name}. PROPERTIES LABELS ${name} DISCOVERY_TIMEOUT 60)
endfunction()
