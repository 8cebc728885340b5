!> The chart `water`: error of the energy of 64 rigid water molecules against the cost of splitting schemes,
!> with the exact rotation for the drift and with the turns of NO_SQUISH.
module frb_chart_water
    use frb, only: wp, splitting_plan, splitting_scheme
    use frb_chart_output, only: chart_file, settings, open_table, open_script, draw, either, progress, say
    use frb_water_model, only: cluster, load, run_water
    implicit none
    private

    public :: chart_water

    character(8), parameter :: names(*) = [character(8) :: 'verlet', 'srkn6', 'srkn11', 'srkn14']
    !> Steps of each scheme [fs], 0 where there are no more.
    real(wp), parameter :: steps(5, size(names)) = reshape([ &
        0.5_wp, 1.0_wp, 2.0_wp, 4.0_wp, 0.0_wp, 2.0_wp, 4.0_wp, 6.0_wp, 8.0_wp, 12.0_wp, &
        4.0_wp, 6.0_wp, 8.0_wp, 12.0_wp, 0.0_wp, 4.0_wp, 6.0_wp, 8.0_wp, 12.0_wp, 0.0_wp], [5, size(names)])

contains

    !> 20 ps of every scheme and step; a block of the table for each scheme and drift.
    subroutine chart_water(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: spacing = 24.0_wp        ! time between samples of the energy [fs]
        character(*), parameter :: molecules = 'data/water64_start.txt'
        type(splitting_scheme) :: scheme
        type(cluster) :: start
        real(wp) :: time, rms
        character(60) :: line
        type(chart_file) :: file
        integer :: i, j, drift, done
        logical :: squish, there

        inquire (file=molecules, exist=there)
        if (.not. there) then
            call say('  not drawn, there is no '//molecules//' from here')
            return
        end if
        time = merge(240.0_wp, 20000.0_wp, options%quick)
        call load(molecules, start)
        call open_table(options, 'water', '64 rigid water molecules: energy against the cost of a scheme', &
            'step [fs], forces per fs, rms of the total energy about its line [kcal/mol]; a block for '// &
            'each scheme and drift', file)
        done = 0
        do i = 1, size(names)
            scheme = splitting_scheme(names(i))
            if (names(i) == 'verlet') scheme = splitting_scheme([1.0_wp], [0.5_wp, 0.5_wp], 'verlet')
            do drift = 1, 2
                squish = drift == 2
                call file%put('# '//trim(names(i))//', '//either(squish, 'NO_SQUISH', 'free flow'))
                do j = 1, size(steps, 1)
                    associate (h => steps(j, i))
                        if (h > 0.0_wp) then
                            call run_water(splitting_plan(scheme, h), h, time, spacing, squish, start, rms)
                            write (line, '(f6.1,f9.3,es12.3)') h, scheme%stages()/h, rms
                            call file%put(trim(line))
                            if (h >= 4.0_wp .and. h <= 4.0_wp) call say('  '//names(i)// &
                                either(squish, ' NO_SQUISH  ', ' free flow  ')//trim(line))
                        end if
                    end associate
                    done = done + 1
                    call progress(options, 'water', done, 2*size(steps))
                end do
                call file%end_block()
            end do
        end do
        call file%finish()
        call draw_water(options)
    end subroutine chart_water

    subroutine draw_water(options)
        type(settings), intent(in) :: options
        type(chart_file) :: file
        integer :: i

        call open_script(options, 'water', 900, 620, file)
        call file%put('set title "64 rigid water molecules: exact rotation, NO_SQUISH (dashed)" noenhanced')
        call file%put('set xlabel "forces per fs"')
        call file%put('set ylabel "rms of the energy [kcal/mol]"')
        call file%put('set logscale xy')
        call file%put('set format y "10^{%T}"')
        call file%put('set key outside right')
        call file%put('plot \')
        do i = 1, size(names)
            write (file%line, '(a,i0,a,i0,a)') '  "water.dat" index ', 2*i - 2, ' using 2:3 with lp lt ', i, &
                ' ps 0.8 title "'//trim(names(i))//'", \'
            call file%put()
            write (file%line, '(a,i0,a,i0,a)') '  "water.dat" index ', 2*i - 1, ' using 2:3 with lp lt ', i, &
                ' dt 2 ps 0.8 notitle'//either(i < size(names), ', \', '')
            call file%put()
        end do
        call file%finish()
        call draw(options, 'water')
    end subroutine draw_water

end module frb_chart_water
