!> Pictures of the motion itself: `orbits` (the polhodes on the sphere of the momentum, and the flips of a
!> tennis racket) and `racket` (the flips again, and below them the errors of energy and momentum).
module frb_chart_orbits
    use frb, only: wp, rigid_body, free_flow, quat_rotate
    use frb_chart_methods, only: method, advance, find_method
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, either
    use frb_taylor_truth, only: qp, taylor_period
    implicit none
    private

    public :: chart_orbits

    !> The methods whose errors are shown below the flips of the racket.
    character(*), parameter :: racket_methods(*) = [character(12) :: 'flow', 'dmv10', 'rk4', 'dp-12']

contains

    !> Polhodes on the sphere, beside them the flips of a racket; then the racket with the errors of methods.
    subroutine chart_orbits(options)
        type(settings), intent(in) :: options

        call write_polhodes(options)
        call write_racket(options)
        call draw_orbits(options)
        call draw_racket(options)
    end subroutine chart_orbits

    !> Polhodes of a body with moments (1, 2, 3), seen from a point between the three axes.
    subroutine write_polhodes(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: moments(3) = [1.0_wp, 2.0_wp, 3.0_wp]
        real(wp), parameter :: angles(*) = [6.0_wp, 14.0_wp, 22.0_wp, 27.0_wp, 33.0_wp, 40.0_wp, 50.0_wp, &
            63.0_wp, 67.0_wp, 72.0_wp, 77.0_wp, 83.0_wp]
        integer, parameter :: points = 120
        type(rigid_body) :: body
        real(qp) :: period, turn(4)
        real(wp) :: m(3), start(3), h, angle
        type(chart_file) :: file
        integer :: i, side, k

        body = rigid_body(moments)
        call open_table(options, 'orbits', &
            'polhodes of I = (1, 2, 3), |m| = 1, seen from (3, 2, 2) without '// &
            'perspective; a block per orbit, the four arcs of the separatrix first', &
            'right, up, 1 if in front', file)
        ! (a1 - a2) m1^2 = (a2 - a3) m3^2 on the separatrix: each arc from the middle axis to its opposite.
        do i = 0, 3
            start = [merge(1, -1, i < 2)*0.5_wp, 0.0_wp, merge(1, -1, mod(i, 2) == 0)*sqrt(0.75_wp)]
            do side = -points, points
                m = start
                call free_flow(body, side*0.3_wp, m)
                call put_point(file, m)
            end do
            call file%end_block()
        end do
        do i = 1, size(angles)
            angle = angles(i)*acos(-1.0_wp)/180
            do side = -1, 1, 2
                ! Around axis 1 for m1 larger than on the separatrix, else around axis 3.
                start = [cos(angle), 0.0_wp, sin(angle)]
                if (start(1) > 0.5_wp) start(1) = side*start(1)
                if (abs(start(1)) <= 0.5_wp) start(3) = side*start(3)
                call taylor_period(real(moments, qp), real(start, qp), 1.0e4_qp, period, turn)
                h = real(period, wp)/points
                m = start
                do k = 0, points
                    call put_point(file, m)
                    call free_flow(body, h, m)
                end do
                call file%end_block()
            end do
        end do
        call file%finish()
    end subroutine write_polhodes

    !> The sphere on the left, the angular velocity of the racket on the right.
    subroutine draw_orbits(options)
        type(settings), intent(in) :: options
        type(chart_file) :: file

        call open_script(options, 'orbits', 1000, 480, file)
        call file%put_lines([character(width) :: &
            'set multiplot', 'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0', &
            'set origin 0.57,0.14', 'set size 0.41,0.76', 'set xrange [0:200]', &
            'set title "A tennis racket, I = (3, 5, 7), turns over again and again" offset 0,-0.3', &
            'set xlabel "time"', 'set ylabel "angular velocity, body axes"'])
        call plot_flips(file)
        call file%put_lines([character(width) :: &
            'set origin 0.0,0.0', 'set size 0.5,0.88', 'unset border', 'unset tics', 'unset grid', &
            'unset xlabel', 'unset ylabel', 'set size ratio -1', 'unset key', &
            'set xrange [-1.35:1.45]', 'set yrange [-1.1:1.3]', &
            'set object 1 circle at 0,0 size first 1 fillstyle solid border lc rgb "#888888" fc rgb '// &
            '"#f4f4f4" behind', &
            'set title "The momentum of a free body, I = (1, 2, 3)" offset 0,0.4'])
        call label_axis(file, [1.0_wp, 0.0_wp, 0.0_wp], 'axis 1')
        call label_axis(file, [0.0_wp, 1.0_wp, 0.0_wp], 'axis 2')
        call label_axis(file, [0.0_wp, 0.0_wp, 1.0_wp], 'axis 3')
        call file%put_lines([character(width) :: &
            'set label 99 "separatrix" tc rgb "#D55E00" at graph 0.02,0.03 front', 'plot \', &
            '  for [k=4:27] "orbits.dat" index k using 1:($3<1?$2:NaN) with lines lc rgb "#cfdbe6" lw 1, \', &
            '  for [k=0:3] "orbits.dat" index k using 1:($3<1?$2:NaN) with lines lc rgb "#f0c9b0" lw 2, \', &
            '  for [k=4:27] "orbits.dat" index k using 1:($3>0?$2:NaN) with lines lc rgb "#0072B2" lw 2, \', &
            '  for [k=0:3] "orbits.dat" index k using 1:($3>0?$2:NaN) with lines lc rgb "#D55E00" lw 3.2', &
            'unset multiplot'])
        call file%finish()
        call draw(options, 'orbits')
    end subroutine draw_orbits

    !> The three curves of the angular velocity of the racket.
    subroutine plot_flips(file)
        type(chart_file), intent(inout) :: file

        call file%put_lines([character(width) :: &
            'set yrange [-0.52:0.62]', 'set key top center horizontal samplen 2.2', 'plot \', &
            '  "racket.dat" index 0 using 1:2 with lines lt 3 lw 2 title "ω_1", \', &
            '  "" index 0 using 1:3 with lines lt 2 lw 3 title "ω_2", \', &
            '  "" index 0 using 1:4 with lines lt 4 lw 2 title "ω_3"'])
    end subroutine plot_flips

    !> One point of a curve on the sphere.
    subroutine put_point(file, m)
        type(chart_file), intent(inout) :: file
        real(wp), intent(in) :: m(3)
        real(wp) :: seen(3)

        seen = view(m)
        write (file%line, '(2f9.5,i3)') seen(1:2), merge(1, 0, seen(3) > 0.0_wp)
        call file%put()
    end subroutine put_point

    !> Right, up and towards the eye, for an eye in the direction (3, 2, 2) with axis 3 upright.
    pure function view(m) result(seen)
        real(wp), intent(in) :: m(3)
        real(wp) :: seen(3)
        real(wp), parameter :: eye(3) = [3.0_wp, 2.0_wp, 2.0_wp]/sqrt(17.0_wp)
        real(wp), parameter :: right(3) = [-2.0_wp, 3.0_wp, 0.0_wp]/sqrt(13.0_wp)
        real(wp), parameter :: up(3) = [eye(2)*right(3) - eye(3)*right(2), &
            eye(3)*right(1) - eye(1)*right(3), eye(1)*right(2) - eye(2)*right(1)]

        seen = [dot_product(right, m), dot_product(up, m), dot_product(eye, m)]
    end function view

    !> An arrow that continues an axis out of the sphere, and its name beyond the tip.
    subroutine label_axis(file, axis, text)
        type(chart_file), intent(inout) :: file
        real(wp), intent(in) :: axis(3)
        character(*), intent(in) :: text
        real(wp) :: from(3), outwards(2)

        from = view(axis)
        outwards = from(1:2)/norm2(from(1:2))
        write (file%line, '(4(a,f7.3),a)') 'set arrow from ', from(1), ',', from(2), ' to ', &
            1.2_wp*outwards(1), ',', 1.2_wp*outwards(2), &
            ' head filled size 0.05,20 lc rgb "#000000" lw 2 front'
        call file%put()
        write (file%line, '(a,f7.3,a,f7.3,a)') 'set label "'//text//'" at ', 1.3_wp*outwards(1), ',', &
            1.3_wp*outwards(2), either(outwards(1) > 0.5_wp, ' left offset -0.8,0', ' center')//' front'
        call file%put()
    end subroutine label_axis

    !> The motion of a tennis racket that starts close to its middle axis, by several methods, with their
    !> errors of energy and momentum.
    subroutine write_racket(options)
        type(settings), intent(in) :: options
        real(wp), parameter :: moments(3) = [3.0_wp, 5.0_wp, 7.0_wp]
        real(wp), parameter :: m0(3) = [0.0_wp, 2.0_wp, 0.01_wp], h = 0.1_wp
        integer, parameter :: steps = 2000
        type(method) :: with
        real(wp) :: m(3), q(4), energy0, energy, space(3)
        type(chart_file) :: file
        integer :: i, k

        call open_table(options, 'racket', &
            'tennis racket, I = (3, 5, 7), m = (0, 2, 0.01) at the start, steps of 0.1; '// &
            'a block per method', &
            't, omega1, omega2, omega3, relative error of the energy, error of the momentum '// &
            'in space over its norm', file)
        energy0 = sum(m0**2/moments)/2
        do i = 1, size(racket_methods)
            with = find_method(trim(racket_methods(i)))
            m = m0
            q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
            call file%put('# method: '//trim(racket_methods(i)))
            do k = 0, steps
                energy = sum(m**2/moments)/2
                space = quat_rotate(q, m) - m0
                if (mod(k, 2) == 0) then
                    write (file%line, '(f7.2,3f10.6,2es11.3)') k*h, m/moments, &
                        max(1.0e-17_wp, abs(energy/energy0 - 1)), max(1.0e-17_wp, norm2(space)/norm2(m0))
                    call file%put()
                end if
                call advance(with, moments, h, 1, m, q)
            end do
            call file%end_block()
        end do
        call file%finish()
    end subroutine write_racket

    !> The flips of the racket, and how well methods keep its energy.
    subroutine draw_racket(options)
        type(settings), intent(in) :: options
        integer, parameter :: symbols(*) = [7, 4, 2, 1]
        type(method) :: with
        type(chart_file) :: file
        integer :: i

        call open_script(options, 'racket', 900, 640, file)
        call file%put_lines([character(width) :: &
            'set multiplot', 'set xrange [0:200]', 'set lmargin at screen 0.1', &
            'set rmargin at screen 0.97', 'set bmargin at screen 0.56', 'set tmargin at screen 0.92', &
            'set title "Tennis racket spun about its middle axis: a flip every half period" offset 0,-0.5', &
            'set ylabel "ω  [rad per unit of time]"', 'set format x ""'])
        call plot_flips(file)
        call file%put_lines([character(width) :: &
            'unset title', 'set bmargin at screen 0.11', 'set tmargin at screen 0.53', 'set logscale y', &
            'set format x "%g"', 'set format y "10^{%T}"', 'set yrange [5e-18:1e1]', 'set xlabel "time"', &
            'set ytics 1e-16,1e4', 'set mytics 1', 'set ylabel "relative error of energy"', &
            'set key top center horizontal', 'plot \'])
        do i = 1, size(racket_methods)
            with = find_method(trim(racket_methods(i)))
            write (file%line, '(3(a,i0),a)') '  "racket.dat" index ', i - 1, &
                ' using 1:5 every 10 with points lt ', with%colour, ' pt ', symbols(i), &
                ' ps 0.5 title "'//trim(with%label)//'"'//either(i == size(racket_methods), '', ', \')
            call file%put()
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, 'racket')
    end subroutine draw_racket

end module frb_chart_orbits
