# Makes the page, or says why there is none:
#   cmake -DNPM=... -DNODE=... -DSOURCE=... -DWORK=... -DPAGE=... -DSTAMP=... -P build_page.cmake
#
# That it cannot be made is no mistake of whoever builds the program, so it stops nothing. There is no stamp then, and the next build
# tries again: that takes no time where npm is missing, and some seconds without a network.
file(MAKE_DIRECTORY ${WORK})
set(why "")

if(NOT NPM OR NOT NODE)
  set(why "npm is missing. Install it (Debian: apt-get install npm)")
else()
  file(SHA256 ${SOURCE}/package-lock.json wanted)
  set(fetched "")
  if(EXISTS ${WORK}/fetched)
    file(READ ${WORK}/fetched fetched)
  endif()
  file(COPY ${SOURCE}/package.json ${SOURCE}/package-lock.json ${SOURCE}/.npmrc ${SOURCE}/build.mjs ${SOURCE}/src DESTINATION ${WORK})
  if(NOT fetched STREQUAL wanted)
    # Nothing that is fetched runs here but esbuild itself, below.
    execute_process(COMMAND ${NPM} ci --ignore-scripts --no-update-notifier --fetch-retries=1 --fetch-timeout=30000
      WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE said TIMEOUT 300)
    if(NOT code EQUAL 0)
      file(WRITE ${WORK}/npm.log "${said}\n")
      set(why "npm could not fetch what it is made of (${WORK}/npm.log). Look whether there is a network")
    else()
      file(WRITE ${WORK}/fetched ${wanted})
    endif()
  endif()
endif()

if(NOT why)
  execute_process(COMMAND ${NODE} build.mjs ${PAGE} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "The page of 'bsp2 view' cannot be made:\n${said}")  # a mistake in its sources
  endif()
  file(TOUCH ${STAMP})
else()
  file(REMOVE_RECURSE ${PAGE})
  file(REMOVE ${WORK}/fetched)
  message("The page of 'bsp2 view' is not made: ${why}, then build again. All else is built.")
endif()
