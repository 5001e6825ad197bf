# Each header compiles alone: one generated source per header that includes nothing else, without the precompiled
# headers that would hide a missing #include. Never linked; -O0 because only the front end matters.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     ${PROJECT_SOURCE_DIR}/app/*.h ${PROJECT_SOURCE_DIR}/core/*.h ${PROJECT_SOURCE_DIR}/estimation/*.h
     ${PROJECT_SOURCE_DIR}/machine/*.h ${PROJECT_SOURCE_DIR}/master/*.h ${PROJECT_SOURCE_DIR}/sim/*.h
     ${PROJECT_SOURCE_DIR}/slave/*.h ${PROJECT_SOURCE_DIR}/transport/*.h ${PROJECT_SOURCE_DIR}/tests/support/*.h)
set(sources)
foreach(header ${headers})
  string(REPLACE ".h" ".cpp" source ${PROJECT_BINARY_DIR}/header_check/${header})
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n#include \"${header}\"\n")
  list(APPEND sources ${source})
endforeach()
add_library(knuckle_header_check OBJECT ${sources})
target_link_libraries(knuckle_header_check PRIVATE knuckle_window knuckle_studies)
target_compile_options(knuckle_header_check PRIVATE -O0 -g0)
