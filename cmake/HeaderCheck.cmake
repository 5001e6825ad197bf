# Each header compiles alone: one generated source per header that includes nothing else. Precompiled is Eigen's core only,
# and only for headers that bring it along themselves, so that it hides no missing #include; that is half the time.
# Never linked; -O0 because only the front end matters. Part of scripts/test --deep only: it is 40 % of all compile steps.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     ${PROJECT_SOURCE_DIR}/app/*.h ${PROJECT_SOURCE_DIR}/core/*.h ${PROJECT_SOURCE_DIR}/estimation/*.h
     ${PROJECT_SOURCE_DIR}/machine/*.h ${PROJECT_SOURCE_DIR}/master/*.h ${PROJECT_SOURCE_DIR}/recording/*.h ${PROJECT_SOURCE_DIR}/sim/*.h
     ${PROJECT_SOURCE_DIR}/slave/*.h ${PROJECT_SOURCE_DIR}/transport/*.h ${PROJECT_SOURCE_DIR}/video/*.h
     ${PROJECT_SOURCE_DIR}/tests/support/*.h)
# brings_eigen(OUT HEADER): whether it includes Eigen, at whatever depth; as it was when CMake last ran.
function(brings_eigen out header)
  get_property(known GLOBAL PROPERTY knuckle_brings_eigen_${header})
  if("${known}" STREQUAL "" AND EXISTS ${PROJECT_SOURCE_DIR}/${header})
    set(known FALSE)
    set_property(GLOBAL PROPERTY knuckle_brings_eigen_${header} FALSE)
    file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include ")
    foreach(line ${includes})
      if(line MATCHES "<Eigen/")
        set(known TRUE)
      elseif(line MATCHES "\"(.+)\"")
        brings_eigen(known ${CMAKE_MATCH_1})
      endif()
      if(known)
        break()
      endif()
    endforeach()
    set_property(GLOBAL PROPERTY knuckle_brings_eigen_${header} ${known})
  endif()
  set(${out} ${known} PARENT_SCOPE)
endfunction()

set(sources)
foreach(header ${headers})
  string(REPLACE ".h" ".cpp" source ${PROJECT_BINARY_DIR}/header_check/${header})
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n#include \"${header}\"\n")
  list(APPEND sources ${source})
  brings_eigen(with_eigen ${header})
  if(NOT with_eigen)
    set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  endif()
endforeach()
add_library(knuckle_header_check OBJECT EXCLUDE_FROM_ALL ${sources})
target_link_libraries(knuckle_header_check PRIVATE knuckle_window knuckle_studies knuckle_mcap)
target_compile_options(knuckle_header_check PRIVATE -O0 -g0)
target_precompile_headers(knuckle_header_check PRIVATE <Eigen/Core>)
set_target_properties(knuckle_header_check PROPERTIES UNITY_BUILD OFF)  # alone
