# Compiler settings shared by every target, and the calls that make one:
#   knuckle_precompile(NAME headers... LINK deps...)   headers that several targets share, compiled once
#   knuckle_library(NAME deps... [PRIVATE deps...])   one static library per folder
#   knuckle_tests(FOLDER deps... [LABEL name])   one GoogleTest binary per test folder; its ctest label, unless FOLDER.
#                                   Its files are compiled twelve at a time: helpers of two files have two names
#   knuckle_fuzzers(deps...)        one libFuzzer binary per tests/fuzz/*_fuzz.cpp
#   knuckle_fuzz_replays(deps...)   one test per tests/fuzz/corpus/NAME: these files once through that fuzzer's check

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# -O2 keeps IEEE semantics (digests repeat); asserts of Eigen stay out of the loops.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
# The sanitizer builds: the same code with line numbers and every assert, Eigen's included.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} ${CCACHE})
endif()

add_library(knuckle_options INTERFACE)
target_compile_options(knuckle_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
                                                 -Wnon-virtual-dtor -Woverloaded-virtual)
if(KNUCKLE_WARNINGS_ARE_ERRORS)
  target_compile_options(knuckle_options INTERFACE -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Eigen's unrolled fixed-size kernels make g++ 12 claim out-of-bounds accesses that are not there.
  target_compile_options(knuckle_options INTERFACE -Wno-array-bounds -Wno-maybe-uninitialized -Wno-stringop-overread)
  # In a batch (CMAKE_UNITY_BUILD) a .cpp counts as a header, whose classes may not have members of unnamed types.
  target_compile_options(knuckle_options INTERFACE $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-subobject-linkage>)
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

# Every target that shares it must be compiled alike: g++ says so where one is not. Its own defines do no harm.
function(knuckle_precompile name)
  cmake_parse_arguments(PARSE_ARGV 1 shared "" "" "LINK")
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp CONTENT "")
  add_library(knuckle_${name} OBJECT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp)
  target_link_libraries(knuckle_${name} PRIVATE knuckle_options Eigen3::Eigen ${shared_LINK})
  target_precompile_headers(knuckle_${name} PRIVATE ${shared_UNPARSED_ARGUMENTS})
endfunction()

function(knuckle_library name)
  cmake_parse_arguments(PARSE_ARGV 1 library "" "" "PRIVATE")
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(sources)
    add_library(knuckle_${name} STATIC ${sources})
    set(scope PUBLIC)
    target_precompile_headers(knuckle_${name} REUSE_FROM knuckle_precompiled)
  else()
    add_library(knuckle_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(knuckle_${name} ${scope} ${PROJECT_SOURCE_DIR})
  target_link_libraries(knuckle_${name} ${scope} knuckle_options Eigen3::Eigen Threads::Threads
                                                ${library_UNPARSED_ARGUMENTS})
  if(library_PRIVATE)
    target_link_libraries(knuckle_${name} PRIVATE ${library_PRIVATE})
  endif()
endfunction()

function(knuckle_tests folder)
  cmake_parse_arguments(PARSE_ARGV 1 tests "" "LABEL;SHARDS" "")
  get_filename_component(name ${folder} NAME)
  if(NOT tests_LABEL)
    set(tests_LABEL ${name})
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  # Object libraries are not passed on by others: each test binary holds the counting malloc itself.
  target_link_libraries(test_${name} PRIVATE ${tests_UNPARSED_ARGUMENTS} knuckle_no_alloc knuckle_test_places
                        GTest::gtest_main)
  target_precompile_headers(test_${name} REUSE_FROM knuckle_precompiled_tests)
  # The suite's name says where it runs: Deep* in `scripts/test --deep` only, *Thread* under TSan as well; each of these
  # tests in a process of its own. The others share SHARDS processes: starting one for each test, with its window or
  # program, costs as much as many of the tests. `ctest -R '^${name}[.]'` selects a folder whole.
  if(NOT tests_SHARDS)
    set(tests_SHARDS 2)
  endif()
  math(EXPR last "${tests_SHARDS} - 1")
  foreach(shard RANGE ${last})
    add_test(NAME ${name}.${shard} COMMAND test_${name} --gtest_filter=-Deep*:*Thread*.*)
    set_tests_properties(${name}.${shard} PROPERTIES LABELS ${tests_LABEL} COST ${tests_SHARDS} TIMEOUT 1200
                         ENVIRONMENT "GTEST_TOTAL_SHARDS=${tests_SHARDS};GTEST_SHARD_INDEX=${shard}")
  endforeach()
  set(common TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60)
  gtest_discover_tests(test_${name} ${common} TEST_FILTER "Deep*" TEST_LIST ${name}_deep_tests
                       PROPERTIES LABELS deep)
  gtest_discover_tests(test_${name} ${common} TEST_FILTER "*Thread*.*:-Deep*" TEST_LIST ${name}_thread_tests
                       PROPERTIES LABELS tsan)
endfunction()

# Needs clang (preset fuzz).
function(knuckle_fuzzers)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/*_fuzz.cpp)
  foreach(source ${sources})
    get_filename_component(name ${source} NAME_WE)
    string(REGEX REPLACE "_fuzz$" "" name ${name})
    add_executable(fuzz_${name} ${source})
    target_link_libraries(fuzz_${name} PRIVATE ${ARGN})
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
    target_compile_definitions(fuzz_${name} PRIVATE KNUCKLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  endforeach()
endfunction()

# Without libFuzzer, so in every build; the files in config/ go through as well.
function(knuckle_fuzz_replays)
  file(GLOB corpora CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/*)
  foreach(corpus ${corpora})
    get_filename_component(name ${corpus} NAME)
    add_executable(replay_${name} fuzz/${name}_fuzz.cpp fuzz/replay.cpp)
    target_link_libraries(replay_${name} PRIVATE ${ARGN})
    target_compile_definitions(replay_${name} PRIVATE KNUCKLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    add_test(NAME fuzz.${name} COMMAND replay_${name} ${corpus} ${PROJECT_SOURCE_DIR}/config)
    set_tests_properties(fuzz.${name} PROPERTIES LABELS fuzz TIMEOUT 60)
  endforeach()
endfunction()
