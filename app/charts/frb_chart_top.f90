!> The charts with torque: `heavy-top` (schemes and drifts, error against time) and `torus` (the paper's
!> figure 7 made again).
module frb_chart_top
    use frb, only: wp, rigid_body, splitting_scheme, heavy_top, body_drift, body_observer, integrate, &
        status_ok
    use frb_chart_methods, only: method, find_method, known, escaped, advance_once, family_dmv
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        either, quantile
    use frb_chart_timing, only: clock
    use frb_dmv, only: dmv_body, new_dmv_body, dmv_steps
    use frb_top_truth, only: qp, taylor_top
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_heavy_top, chart_torus

    !> The paper's heavy top, section 4.3.
    real(wp), parameter :: paper_moments(3) = [1.0_wp, 1.0126869887825154_wp, 3.3062374224730378_wp]
    real(wp), parameter :: paper_m0(3) = [-0.34790957088547336_wp, -0.19822914599675923_wp, &
        -0.91633189192763642_wp]
    real(wp), parameter :: paper_u0(3) = [9.5586303547238536e-5_wp, 4.8777318247201465e-4_wp, &
        -8.6772148817192390e-4_wp]

    !> A drift by any method of the catalogue; the rival's constants are set up once.
    type, extends(body_drift) :: catalogue_drift
        type(method) :: with
        type(dmv_body) :: rival
    contains
        procedure :: advance => advance_drift
    end type catalogue_drift

    !> A pair of scheme and drift, and how it is drawn.
    type :: pairing
        character(8) :: scheme = ''
        character(12) :: drift = ''
        integer :: colour = 1, dash = 1, symbol = 7, width = 2
    end type pairing

    !> Collects momenta on a grid of pixels.
    type, extends(body_observer) :: raster
        real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp       !! corners of the window in (m1, m2)
        integer, allocatable :: hits(:, :)
    contains
        procedure :: observe => observe_raster
    end type raster

contains

    !> Error of the attitude of three tops against the time spent, for schemes and drifts.
    subroutine chart_heavy_top(options)
        type(settings), intent(in) :: options
        character(*), parameter :: names(3) = [character(10) :: 'paper', 'asymmetric', 'flat']
        character(*), parameter :: titles(3) = [character(60) :: 'the paper''s top, |V| = 0.001, t = 100', &
            'Hairer-Vilmart top (0.6, 0.8, 1), t = 10', 'Hairer-Vilmart top (0.345, 0.653, 1), t = 10']
        real(wp), parameter :: moments(3, 3) = reshape([paper_moments, 0.6_wp, 0.8_wp, 1.0_wp, 0.345_wp, &
            0.653_wp, 1.0_wp], [3, 3])
        real(wp), parameter :: m0(3, 3) = reshape([paper_m0, 1.8_wp, 0.4_wp, -0.9_wp, 1.8_wp, 0.4_wp, &
            -0.9_wp], [3, 3])
        real(wp), parameter :: u0(3, 3) = reshape([paper_u0, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
            1.0_wp], [3, 3])
        real(wp), parameter :: duration(3) = [100.0_wp, 10.0_wp, 10.0_wp]
        integer, parameter :: first_steps(3) = [4, 8, 8]
        type(pairing), allocatable :: pairs(:)
        real(wp), allocatable :: errors(:, :), ns(:, :, :)
        type(chart_file) :: file
        integer :: s, i, k, most

        allocate (pairs, source=pairings())
        most = merge(6, 11, options%quick)
        allocate (errors(most, size(pairs)), ns(3, most, size(pairs)))
        do s = 1, size(names)
            call measure(options, pairs, moments(:, s), m0(:, s), u0(:, s), duration(s), first_steps(s), &
                errors, ns)
            call open_table(options, 'heavy-top-'//trim(names(s)), 'error against time spent: '// &
                trim(titles(s))//'; a block per scheme and drift', &
                'steps, time [ns]: median, quartiles; error of attitude [rad]', file)
            do i = 1, size(pairs)
                call file%put('# '//trim(pairs(i)%scheme)//' with '//trim(pairs(i)%drift))
                do k = 1, most
                    write (file%line, '(i8,3es13.4,es12.3)') steps_at(options, first_steps(s), k), ns(:, &
                        k, i), &
                        errors(k, i)
                    call file%put()
                end do
                call file%end_block()
            end do
            call file%finish()
        end do
        call draw_heavy_top(options, pairs, names, titles)
    end subroutine chart_heavy_top

    function pairings() result(pairs)
        type(pairing), allocatable :: pairs(:)
        type(pairing), parameter :: all_pairs(*) = [ &
            pairing('strang', 'flow', 8, 1, 7, 2), pairing('yoshida4', 'flow', 1, 1, 9, 2), &
            pairing('srkn6', 'flow', 7, 1, 11, 2), pairing('s6', 'flow', 4, 1, 13, 2), &
            pairing('srkn11', 'flow', 6, 1, 5, 3), pairing('srkn14', 'flow', 2, 1, 7, 4), &
            pairing('aba864', 'flow', 5, 1, 15, 3), pairing('strang', 'dmv2', 8, 2, 6, 2), &
            pairing('strang', 'dmv10', 3, 2, 4, 2), pairing('srkn14', 'dmv10', 3, 3, 8, 3), &
            pairing('srkn14', 'frb_step', 2, 2, 6, 2), pairing('srkn14', 'quat_step', 2, 3, 4, 2), &
            pairing('srkn14', 'quat_step-2', 5, 3, 2, 2)]
        integer :: i

        allocate (pairs, source=pack(all_pairs, [(known(all_pairs(i)%drift), i=1, size(all_pairs))]))
    end function pairings

    pure function steps_at(options, first, k) result(steps)
        type(settings), intent(in) :: options
        integer, intent(in) :: first, k
        integer :: steps

        steps = first*2**merge(2*(k - 1), k - 1, options%quick)
    end function steps_at

    !> Times, all pairs in turn, and errors.
    subroutine measure(options, pairs, moments, m0, u0, duration, first, errors, ns)
        type(settings), intent(in) :: options
        type(pairing), intent(in) :: pairs(:)
        real(wp), intent(in) :: moments(3), m0(3), u0(3), duration
        integer, intent(in) :: first
        real(wp), intent(out) :: errors(:, :)       !! (number of steps, pair)
        real(wp), intent(out) :: ns(:, :, :)        !! (median and quartiles, number of steps, pair)
        real(wp), allocatable :: times(:, :)
        real(qp) :: m_end(3), q_end(4)
        real(wp) :: m(3), q(4), seconds
        integer :: i, k, r, repetitions, rounds(size(pairs))

        m_end = m0
        q_end = [1.0_qp, 0.0_qp, 0.0_qp, 0.0_qp]
        call taylor_top(real(moments, qp), real(u0, qp), real(duration, qp), m_end, q_end)
        repetitions = merge(5, 9, options%quick)
        allocate (times(repetitions, size(pairs)))
        do k = 1, size(errors, 1)
            do i = 1, size(pairs)
                call run(pairs(i), moments, m0, u0, duration, steps_at(options, first, k), 1, m, q, seconds)
                errors(k, i) = max(1.0e-17_wp, real(2*min(norm2(q - q_end), norm2(q + q_end)), wp))
                rounds(i) = int(merge(0.3e-3_wp, 1.0e-3_wp, options%quick)/max(seconds, 1.0e-7_wp))
                rounds(i) = max(1, min(1000, rounds(i)))
            end do
            do r = 1, repetitions
                do i = 1, size(pairs)
                    call run(pairs(i), moments, m0, u0, duration, steps_at(options, first, k), rounds(i), &
                        m, q, seconds)
                    times(r, i) = 1.0e9_wp*seconds/rounds(i)
                end do
            end do
            do i = 1, size(pairs)
                ns(:, k, i) = [quantile(times(:, i), 0.5_wp), quantile(times(:, i), 0.25_wp), &
                               quantile(times(:, i), 0.75_wp)]
            end do
            call progress(options, 'heavy-top', k, size(errors, 1))
        end do
    end subroutine measure

    !> Integrates a top `rounds` times over, each from its start.
    subroutine run(pair, moments, m0, u0, duration, steps, rounds, m, q, seconds)
        type(pairing), intent(in) :: pair
        real(wp), intent(in) :: moments(3), m0(3), u0(3), duration
        integer, intent(in) :: steps, rounds
        real(wp), intent(out) :: m(3), q(4), seconds
        type(catalogue_drift) :: drift
        type(splitting_scheme) :: scheme
        type(heavy_top) :: scene
        type(rigid_body) :: body
        real(wp) :: start
        integer :: pass, stat

        body = rigid_body(moments)
        scheme = splitting_scheme(trim(pair%scheme))
        scene%force = u0
        drift%with = find_method(trim(pair%drift))
        drift%rival = new_dmv_body(moments)
        start = clock(.false.)
        do pass = 1, rounds
            m = m0
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            if (pair%drift == 'flow') then
                call integrate(body, scheme, scene, duration/steps, steps, m, q, stat=stat)
            else
                call integrate(body, scheme, scene, duration/steps, steps, m, q, drift=drift, stat=stat)
            end if
        end do
        seconds = clock(.false.) - start
        if (stat /= status_ok) q = 1.0_wp
    end subroutine run

    !> One drift by the method.
    subroutine advance_drift(self, body, h, m, q, stat)
        class(catalogue_drift), intent(in) :: self
        type(rigid_body), intent(in) :: body
        real(wp), intent(in) :: h
        real(wp), intent(inout) :: m(3), q(4)
        integer, intent(out) :: stat

        if (self%with%family == family_dmv) then
            call dmv_steps(self%rival, self%with%option, h, 1, m, q)
            stat = status_ok
        else
            call advance_once(self%with, body%moments(), h, m, q, stat)
        end if
    end subroutine advance_drift

    subroutine draw_heavy_top(options, pairs, names, titles)
        type(settings), intent(in) :: options
        type(pairing), intent(in) :: pairs(:)
        character(*), intent(in) :: names(:), titles(:)
        character(160) :: clause
        type(chart_file) :: file
        integer :: s, i

        call open_script(options, 'heavy-top', 1000, 940, file)
        call file%put_lines([character(width) :: &
            'set multiplot', 'set logscale xy', 'set format x "10^{%T}"', &
            'set format y "10^{%T}"', &
            'set yrange [1e-16:30]', 'set xrange [2e2:2e7]', 'set ytics 1e-16,1e2', &
            'set xlabel "time spent  [ns]" offset 0,0.4', 'set ylabel "error of attitude  [rad]"', &
            'unset key', 'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0'])
        do s = 1, size(names)
            write (file%line, '(a,f5.3,a,f5.3)') 'set origin ', merge(0.08, 0.58, mod(s, 2) == 1), ',', &
                merge(0.56, 0.07, s < 3)
            call file%put()
            call file%put('set title "'//trim(titles(s))//'" offset 0,-0.6')
            call file%put_lines([character(width) :: 'set size 0.40,0.40', 'plot \'])
            do i = 1, size(pairs)
                write (file%line, '(a,i0,a)') '  "heavy-top-'//trim(names(s))//'.dat" index ', i - 1, &
                    ' using 2:5'//curve(pairs(i), 'notitle')//either(i == size(pairs), '', ', \')
                call file%put()
            end do
        end do
        call file%put_lines([character(width) :: &
            'set origin 0.53,0.05', 'set size 0.47,0.45', 'unset border', 'unset tics', &
            'unset xlabel', &
            'unset ylabel', 'unset title', 'unset grid', 'unset logscale', 'set xrange [0:1]', &
            'set yrange [0:1]', &
            'set key center center maxrows 14 samplen 2.2 spacing 1.1 Left reverse', 'plot \'])
        do i = 1, size(pairs)
            clause = trim(pairs(i)%scheme)//', '//either(pairs(i)%drift == 'flow', 'free flow', &
                escaped(pairs(i)%drift))
            call file%put('  NaN'//curve(pairs(i), 'title "'//trim(clause)//'"')// &
                either(i == size(pairs), '', ', \'))
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, 'heavy-top')
    end subroutine draw_heavy_top

    !> End of a plot clause for a pair.
    function curve(pair, title) result(clause)
        type(pairing), intent(in) :: pair
        character(*), intent(in) :: title
        character(:), allocatable :: clause
        character(80) :: text

        write (text, '(4(a,i0),a)') ' with linespoints lt ', pair%colour, ' dt ', pair%dash, ' pt ', &
            pair%symbol, ' lw ', pair%width, ' ps 0.7'
        clause = trim(text)//' '//title
    end function curve

    !> The momentum of the paper's top over a long time, as a density of points, and a close-up.
    subroutine chart_torus(options)
        type(settings), intent(in) :: options
        type(raster) :: whole, detail
        type(chart_file) :: file

        call run_torus([-0.46_wp, -0.46_wp], [0.46_wp, 0.46_wp], 400, whole)
        call run_torus([0.3972_wp, -0.06_wp], [0.4002_wp, 0.06_wp], 240, detail)
        call open_table(options, 'torus', &
            'where the momentum of the paper''s heavy top is, h = 0.5, t up to 5e4; '// &
            'blocks: the whole, a close-up', 'm1, m2, number of steps in the pixel (NaN: none)', file)
        call write_raster(whole)
        call write_raster(detail)
        call file%finish()
        call open_script(options, 'torus', 1000, 520, file)
        call file%put_lines([character(width) :: &
            'set multiplot layout 1,2', 'set size ratio -1', 'unset key', 'unset colorbox', &
            'set xlabel "m_1"', 'set ylabel "m_2"', 'set logscale cb', 'set xrange [-0.46:0.46]', &
            'set yrange [-0.46:0.46]', 'set palette defined (0 "#9ecae1", 1 "#0072B2", 2 "#002b4d")', &
            'set title "Heavy top, 100 000 steps of 0.5"', &
            'plot "torus.dat" index 0 using 1:2:3 with image', &
            'set title "Close-up"', 'set xrange [0.3972:0.4002]', 'set yrange [-0.06:0.06]', &
            'set xtics 0.001', 'set ytics 0.02', 'set size noratio', &
            'plot "torus.dat" index 1 using 1:2:3 with image', 'unset multiplot'])
        call file%finish()
        call draw(options, 'torus')

    contains

        subroutine write_raster(from)
            type(raster), intent(in) :: from
            real(wp) :: pixel(2)
            integer :: i, j

            pixel = (from%high - from%low)/shape(from%hits)
            do j = 1, size(from%hits, 2)
                do i = 1, size(from%hits, 1)
                    write (file%line, '(2f10.5,1x,a)') from%low + ([i, j] - 0.5_wp)*pixel, &
                        text_of(from%hits(i, j))
                    call file%put()
                end do
            end do
            call file%end_block()
        end subroutine write_raster

        function text_of(hits) result(text)
            integer, intent(in) :: hits
            character(8) :: text

            text = 'NaN'
            if (hits > 0) write (text, '(i0)') hits
        end function text_of

    end subroutine chart_torus

    subroutine run_torus(low, high, pixels, seen)
        real(wp), intent(in) :: low(2), high(2)
        integer, intent(in) :: pixels
        type(raster), intent(out) :: seen
        type(heavy_top) :: scene
        real(wp) :: m(3), q(4)

        allocate (seen%hits(pixels, pixels), source=0)
        seen%low = low
        seen%high = high
        scene%force = paper_u0
        m = paper_m0
        q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
        call integrate(rigid_body(paper_moments), splitting_scheme('srkn14'), scene, 0.5_wp, 100000, m, q, &
            observer=seen)
    end subroutine run_torus

    subroutine observe_raster(self, step, t, m, q, stop)
        class(raster), intent(inout) :: self
        integer(int64), intent(in) :: step
        real(wp), intent(in) :: t, m(3), q(4)
        logical, intent(inout) :: stop
        integer :: pixel(2)

        associate (unused_step => step, unused_t => t, unused_q => q, unused_stop => stop)
        end associate
        if (any(m(1:2) <= self%low) .or. any(m(1:2) >= self%high)) return
        pixel = 1 + int((m(1:2) - self%low)/(self%high - self%low)*shape(self%hits))
        pixel = min(pixel, shape(self%hits))
        self%hits(pixel(1), pixel(2)) = self%hits(pixel(1), pixel(2)) + 1
    end subroutine observe_raster

end module frb_chart_top
