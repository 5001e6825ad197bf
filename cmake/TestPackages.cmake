# What only tests, benchmarks and studies need. Where some of it is missing, all of these are left out, and KNUCKLE_TESTS is
# false: building `knuckle` asks for none of it.
find_package(GTest QUIET)
find_package(benchmark QUIET)
find_package(orocos_kdl QUIET)
find_library(MUJOCO_LIBRARY mujoco)  # Debian's CMake package of it names folders that are in no package
find_library(URDFDOM_LIBRARY urdfdom_model)
find_library(XGBOOST_LIBRARY xgboost)  # its CMake package asks for its command line program as well
if(KNUCKLE_MPI)
  set(MPI_CXX_SKIP_MPICXX ON)  # the C interface alone
  find_package(MPI QUIET COMPONENTS CXX)
else()
  set(MPI_FOUND TRUE)
endif()
set(missing)
foreach(package GTest_FOUND benchmark_FOUND orocos_kdl_FOUND MUJOCO_LIBRARY URDFDOM_LIBRARY XGBOOST_LIBRARY MPI_FOUND)
  if(NOT ${package})
    string(REGEX REPLACE "_(FOUND|LIBRARY)$" "" package ${package})
    list(APPEND missing ${package})
  endif()
endforeach()
if(missing)
  set(KNUCKLE_TESTS FALSE)
  message(STATUS "Without tests, benchmarks and knuckle-studies: missing ${missing} (scripts/setup installs all)")
else()
  set(KNUCKLE_TESTS TRUE)
endif()
