# Installs laban into an empty folder, builds a program against it by find_package and runs it.
#   cmake -DBUILD=.. -DSOURCE=.. -DWORK=.. -DCLIP=.. -DCOMPILER=.. -P test_package.cmake
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/package/consumer -B ${WORK}/build -G Ninja
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_CXX_COMPILER=${COMPILER})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer ${CLIP})
if(NOT output MATCHES "laban [0-9.]+: [1-9][0-9]* frames")
  message(FATAL_ERROR "the consumer printed: ${output}")
endif()

# The installed program finds its model and its man page is there.
run(${WORK}/prefix/bin/laban inspect ${WORK}/prefix/share/laban/phrase.laban)
foreach(file share/man/man1/laban.1 share/bash-completion/completions/laban)
  if(NOT EXISTS ${WORK}/prefix/${file})
    message(FATAL_ERROR "${file} was not installed")
  endif()
endforeach()
