!> The chart `torus`: the paper's figure 7 made again.
module frb_chart_torus
    use frb, only: wp, rigid_body, splitting_scheme, heavy_top, body_observer, integrate
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw
    use frb_chart_solvers, only: top_at_start, papers_top
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_torus

    !> Collects momenta on a grid of pixels.
    type, extends(body_observer) :: raster
        real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp       !! corners of the window in (m1, m2)
        integer, allocatable :: hits(:, :)
    contains
        procedure :: observe => observe_raster
    end type raster

contains

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
        type(top_at_start) :: top
        type(heavy_top) :: scene
        real(wp) :: m(3), q(4)

        allocate (seen%hits(pixels, pixels), source=0)
        seen%low = low
        seen%high = high
        top = papers_top()
        scene%force = top%force
        m = top%m0
        q = top%q0
        call integrate(rigid_body(top%moments), splitting_scheme('srkn14'), scene, 0.5_wp, 100000, m, q, &
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

end module frb_chart_torus
