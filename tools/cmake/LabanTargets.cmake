# How a module, a test of a module and a warning policy are spelled in this project.

add_library(laban_warnings INTERFACE)
target_compile_options(laban_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  $<$<BOOL:${LABAN_WARNINGS_AS_ERRORS}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 sees overlaps and overruns in std::string's operator+ that are not there (GCC bug 105651),
  # and minds fields that a designated initialiser leaves at their default.
  target_compile_options(laban_warnings INTERFACE
    -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-missing-field-initializers)
endif()

# Headers that nearly every file includes, compiled once: Eigen alone costs seconds a file.
set(LABAN_PRECOMPILED_HEADERS <Eigen/Dense> <Eigen/Geometry> <algorithm> <optional> <span> <string> <vector>)

# laban_quick_build(target header..): how a library or a program of ours is compiled fast. Its own files
# one by one share precompiled headers; in a unity build (presets demo, sanitize) a target is one
# file, a third of the work from scratch, so a name in an unnamed namespace is unique in its folder: an
# overload of it, or of a public function, may be taken for it unseen.
function(laban_quick_build target)
  if(CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 0)
  else()
    target_precompile_headers(${target} PRIVATE ${LABAN_PRECOMPILED_HEADERS} ${ARGN})
  endif()
endfunction()

# laban_module(align SOURCES dtw.cpp DEPENDS motion PRIVATE lib)
#
# One folder, one namespace, one target: src/align and include/laban/align become laban::align,
# linked PUBLIC to the modules in DEPENDS. PRIVATE names libraries that no public header shows.
function(laban_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;PRIVATE" ${ARGN})
  add_library(laban_${name} STATIC ${ARG_SOURCES})
  add_library(laban::${name} ALIAS laban_${name})
  set_target_properties(laban_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_compile_features(laban_${name} PUBLIC cxx_std_20)
  target_include_directories(laban_${name}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  foreach(module IN LISTS ARG_DEPENDS)
    target_link_libraries(laban_${name} PUBLIC laban::${module})
  endforeach()
  target_link_libraries(laban_${name} PRIVATE $<BUILD_INTERFACE:laban_warnings> ${ARG_PRIVATE})
  if(NOT name STREQUAL "base")
    laban_quick_build(laban_${name})
  endif()
  install(TARGETS laban_${name} EXPORT laban-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  set_property(GLOBAL APPEND PROPERTY LABAN_MODULES ${name})
endfunction()

# laban_discover_tests(align): every case of align_test its own ctest entry; with LABAN_TEST_PROGRAMS_WHOLE
# the program is one, so that what its cases share is learnt once.
function(laban_discover_tests module)
  if(LABAN_TEST_PROGRAMS_WHOLE)
    add_test(NAME ${module} COMMAND ${module}_test --gtest_brief=1)
    set_tests_properties(${module} PROPERTIES TIMEOUT 1800 COST 1000)  # before what is short
  else()
    gtest_discover_tests(${module}_test TEST_PREFIX "${module}." DISCOVERY_TIMEOUT 120
      PROPERTIES TIMEOUT 600)
  endif()
endfunction()

# laban_test(align SOURCES dtw_test.cpp): one executable a module.
function(laban_test module)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${module}_test ${ARG_SOURCES})
  target_link_libraries(${module}_test PRIVATE laban::${module} laban_test_support ${ARG_LIBRARIES})
  target_precompile_headers(${module}_test REUSE_FROM laban_test_support)
  laban_discover_tests(${module})
endfunction()
