!> The chart `failure`: error, in units of the inherent sensitivity (the error caused by rounding the input),
!> against closeness to every place where methods are known to fail, one panel each.
module frb_chart_failure
    use frb, only: wp
    use frb_chart_methods, only: method, methods_without, style, family_momentum, family_dp, family_frames
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        quantile, say, either, uniform, random_direction
    use frb_chart_truth, only: free_case, new_case, add_sensitivity, errors_of
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_failure
    public :: panels, names, distances, new_failure_case, failed    ! for the chart `tangent`
    public :: begin_panels, begin_panel, begin_legend

    integer, parameter :: panels = 9
    character(*), parameter :: names(panels) = [character(12) :: 'separatrix', 'axis-1', 'axis-2', 'axis-3', &
        'I1-is-I2', 'I2-is-I3', 'sphere', 'm3-pole', 'h']
    character(*), parameter :: titles(panels) = [character(40) :: 'distance to the separatrix', &
        'distance to axis 1 (stable)', 'distance to axis 2 (unstable)', 'distance to axis 3 (stable)', &
        '1 - I_1/I_2  (symmetric body)', '1 - I_2/I_3  (symmetric body)', '1 - I_1/I_3  (sphere)', &
        'distance to m = (0, 0, -1), m_1 = 0', 'step h']
    !> The score of a method that gives NaN or Inf, or refuses.
    real(wp), parameter :: failed = 1.0e18_wp
    real(wp), parameter :: floor_of_scores = 1.0e-2_wp
    !> The approximate methods take steps of this angle [rad], at most `most_steps`.
    real(wp), parameter :: small_step = 0.02_wp
    real(wp), parameter :: most_steps = 2.0e4_wp

contains

    subroutine chart_failure(options)
        type(settings), intent(in) :: options
        type(method), allocatable :: methods(:)
        type(free_case), allocatable :: cases(:, :)
        real(wp), allocatable :: distance(:), scores(:, :, :)
        type(chart_file) :: file
        integer :: p, k, c, i, per_point, points, worst(2)
        character(200) :: line

        allocate (methods, source=chosen())
        per_point = merge(2, 7, options%quick)
        do p = 1, panels
            allocate (distance, source=distances(p, options%quick))
            points = size(distance)
            allocate (cases(per_point, points), scores(2, size(methods), points))
            do k = 1, points
                do c = 1, per_point
                    cases(c, k) = new_failure_case(p, distance(k), c)
                    call add_sensitivity(cases(c, k))
                end do
                do i = 1, size(methods)
                    call score(methods(i), cases(:, k), scores(:, i, k))
                end do
                call progress(options, 'failure', (p - 1)*points + k, panels*points)
            end do
            call open_table(options, 'failure-'//trim(names(p)), &
                'error in units of the inherent sensitivity '// &
                'against '//trim(titles(p))//'; a block per method', &
                'distance (0 drawn at 1e-17), median score, '// &
                'largest score; 1e18: NaN or refused; approximate methods take steps of 0.02 rad', file)
            do i = 1, size(methods)
                call file%put('# method: '//trim(methods(i)%key))
                do k = 1, points
                    if (scores(2, i, k) < 0.0_wp) cycle
                    write (file%line, '(3es12.3)') merge(1.0e-17_wp, distance(k), distance(k) <= 0.0_wp), &
                        scores(:, i, k)
                    call file%put()
                end do
                call file%end_block()
            end do
            call file%finish()
            worst = [1, maxloc(scores(2, 1, :), dim=1)]
            write (line, '(a,2(a,es9.2))') '  '//names(p), ': free flow at most ', scores(2, 1, worst(2)), &
                ' units, at ', distance(worst(2))
            call say(trim(line))
            if (scores(2, 1, worst(2)) > 4.0_wp) then
                do c = 1, per_point
                    write (line, '(a,7es24.16)') '    ', cases(c, worst(2))%moments, cases(c, worst(2))%m0, &
                        cases(c, worst(2))%t
                    call score(methods(1), cases(c:c, worst(2)), scores(:, 1, 1))
                    if (scores(2, 1, 1) > 4.0_wp) call say(trim(line))
                end do
            end if
            deallocate (distance, cases, scores)
        end do
        call progress(options, 'failure', 1, 1)
        call draw_failure(options, methods)
    end subroutine chart_failure

    function chosen() result(kept)
        type(method), allocatable :: kept(:)

        allocate (kept, source=methods_without([family_momentum, family_frames], ['dp-15', 'dp-9 ']))
    end function chosen

    !> The distances of a panel, down to 0; for the last panel the steps.
    function distances(panel, quick) result(values)
        integer, intent(in) :: panel
        logical, intent(in) :: quick
        real(wp), allocatable :: values(:)
        integer :: k

        if (panel == 9) then
            allocate (values, source=[(10.0_wp**k, k=-8, 8, merge(4, 1, quick))])
        else
            allocate (values, source=[[(10.0_wp**(-k), k=1, 16, merge(5, 1, quick))], 0.0_wp])
        end if
    end function distances

    !> A random case of a panel. All distances have the same cases but for the distance itself.
    function new_failure_case(panel, distance, number) result(item)
        integer, intent(in) :: panel
        real(wp), intent(in) :: distance
        integer, intent(in) :: number
        type(free_case) :: item
        real(wp) :: moments(3), m(3), x(6), angle, sign_of
        integer(int64) :: seed
        integer :: i

        seed = 1000003_int64*panel + 7919_int64*number
        do i = 1, 12
            call uniform(seed, x(1))
        end do
        do i = 1, 6
            call uniform(seed, x(i))
        end do
        call random_direction(seed, m)
        sign_of = merge(1.0_wp, -1.0_wp, x(6) > 0.5_wp)
        moments(3) = 1.0_wp
        moments(2) = 0.55_wp + 0.4_wp*x(1)
        moments(1) = (1 - moments(2)) + (0.05_wp + 0.9_wp*x(2))*(2*moments(2) - 1)
        angle = 6.283185307179586_wp*x(3)
        select case (panel)
        case (1)
            ! (a1 - a2) m1^2 = (a2 - a3) m3^2 on the separatrix; for these moments m1 = m3 exactly.
            moments = [2.0_wp, 3.0_wp, 6.0_wp]
            m(1) = sign_of*m(3)*(1 + merge(1.0_wp, -1.0_wp, x(5) > 0.5_wp)*distance)
        case (2)
            m = [sign_of, distance*cos(angle), distance*sin(angle)]
        case (3)
            m = [distance*cos(angle), sign_of, distance*sin(angle)]
        case (4)
            m = [distance*cos(angle), distance*sin(angle), sign_of]
        case (5)
            moments(1) = moments(2)*(1 - distance)
        case (6)
            moments(2) = 1 - distance
        case (7)
            moments(1) = 1 - distance
            moments(2) = 1 - distance*x(2)
        case (8)
            m = [0.0_wp, distance*sign_of, -1.0_wp]
        case default        ! 9: short steps, see below
        end select
        item = new_case(moments, m, merge(distance*(0.5_wp + x(4)), (2 + 8*x(4))/norm2(m/moments), &
            panel == 9))
    end function new_failure_case

    !> Median and largest score of a method over the cases: the larger of those of momentum and attitude.
    !> Negative when the method would need too many steps.
    subroutine score(with, cases, scores)
        type(method), intent(in) :: with
        type(free_case), intent(in) :: cases(:)
        real(wp), intent(out) :: scores(2)
        real(wp) :: each(size(cases)), error_m, error_q, angle
        integer :: c, nsteps

        do c = 1, size(cases)
            angle = abs(cases(c)%t)*norm2(cases(c)%m0/cases(c)%moments)
            nsteps = 1
            if (.not. with%exact .and. with%family /= family_dp) then
                nsteps = max(1, ceiling(min(angle/small_step, 1.0e9_wp)))
            end if
            if (nsteps > most_steps .or. (with%family == family_dp .and. angle > most_steps*small_step)) then
                scores = -1.0_wp
                return
            end if
            call errors_of(with, cases(c), nsteps, error_m, error_q)
            each(c) = failed
            if (error_m < 1.0e10_wp .and. error_q < 1.0e10_wp) then
                each(c) = max(floor_of_scores, error_m/cases(c)%unit_m, error_q/cases(c)%unit_q)
            end if
        end do
        scores = [quantile(each, 0.5_wp), maxval(each)]
    end subroutine score

    subroutine draw_failure(options, methods)
        type(settings), intent(in) :: options
        type(method), intent(in) :: methods(:)
        character(*), parameter :: shown(*) = [character(12) :: 'rk4', 'rotations4', 'dmv2', 'dmv10', &
            'dp-15', &
            'quat_step-1', 'quat_step-3', 'quat_step-f3', 'quat_step-f2', 'quat_step', 'frb_step', &
            'flow-batch', 'flow']
        type(chart_file) :: file
        integer :: p, i, j, entries

        call open_script(options, 'failure', 1000, 1080, file)
        call begin_panels(file, 'Largest error of '//either(options%quick, '2', '7')// &
                          ' random cases; 1 unit: the error that rounding the input causes')
        do p = 1, panels
            call begin_panel(file, p, [character(80) :: 'set xrange [3e-9:3e8]', &
                'set xtics ("10^{-8}" 1e-8, "10^{-4}" 1e-4, "1" 1, "10^4" 1e4, "10^8" 1e8)'])
            do j = 1, size(shown)
                do i = 1, size(methods)
                    if (methods(i)%key == shown(j)) then
                        write (file%line, '(a,i0,a)') '  "failure-'//trim(names(p))// &
                            '.dat" index ', i - 1, ' using 1:3'//style(methods(i), '')//', \'
                        call file%put()
                    end if
                end do
            end do
            call file%put('  NaN notitle')
        end do
        call begin_legend(file, 'maxrows 4 samplen 2.2 width -4 spacing 1.2')
        entries = 0
        do j = size(shown), 1, -1
            do i = 1, size(methods)
                if (methods(i)%key == shown(j)) then
                    call file%put('  NaN'//style(methods(i))//', \')
                    entries = entries + 1
                end if
            end do
        end do
        call file%put_lines([character(width) :: '  NaN notitle', 'unset multiplot'])
        call file%finish()
        call draw(options, 'failure')
    end subroutine draw_failure

    !> The settings that all panels share, under one title.
    subroutine begin_panels(file, title)
        type(chart_file), intent(inout) :: file
        character(*), intent(in) :: title

        call file%put('set multiplot title "'//title//'"')
        call file%put_lines([character(width) :: 'set logscale xy', 'set format y "10^{%T}"', &
            'set yrange [5e-3:1e19]', 'set ytics 1,1e4', 'set mytics 1', &
            'set ytics add ("NaN" 1e18)', 'unset key', &
            'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0', 'set size 0.25,0.195'])
    end subroutine begin_panels

    !> Place, axes and title of a panel, and the band up to 4 units as the first curve of its plot.
    subroutine begin_panel(file, panel, axis_of_steps)
        type(chart_file), intent(inout) :: file
        integer, intent(in) :: panel
        character(*), intent(in) :: axis_of_steps(:)    !! range and tics of x in the last panel

        if (panel == panels) then
            call file%put_lines(axis_of_steps)
        else
            call file%put_lines([character(width) :: 'set xrange [0.3:3e-18]', &
                'set xtics ("0" 1e-17, "10^{-15}" 1e-15, "10^{-10}" 1e-10, "10^{-5}" 1e-5, "10^{-1}" 1e-1)'])
        end if
        write (file%line, '(a,f6.4,a,f6.4)') 'set origin ', 0.075 + 0.315*mod(panel - 1, 3), ',', &
            0.74 - 0.26*((panel - 1)/3)
        call file%put()
        call file%put(either(mod(panel, 3) == 1, 'set ylabel "error  [units]" offset 1.2,0', 'unset ylabel'))
        call file%put('set title "'//trim(titles(panel))//'" offset 0,-0.7')
        call file%put_lines([character(width) :: 'plot \', &
            '  4 with filledcurves y1=1e-3 lc rgb "#eeeeee" notitle, \'])
    end subroutine begin_panel

    !> The legend below all panels, and its entry for the band up to 4 units.
    subroutine begin_legend(file, layout)
        type(chart_file), intent(inout) :: file
        character(*), intent(in) :: layout

        call file%put_lines([character(width) :: &
            'set origin 0.03,0.005', 'set size 0.94,0.16', 'unset border', 'unset tics', 'unset ylabel', &
            'unset title', 'unset grid', 'unset logscale', 'set xrange [0:1]', 'set yrange [0:1]', &
            'set key center center '//layout//' Left reverse', &
            'plot NaN with boxes fs solid noborder lc rgb "#eeeeee" title "up to 4 units", \'])
    end subroutine begin_legend

end module frb_chart_failure
